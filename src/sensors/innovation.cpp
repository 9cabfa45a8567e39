#include "rio_t/sensors/innovation.h"

#include <Eigen/Cholesky>

namespace rio_t {

double Innovation::squaredSigmas() const { return d.dot(S.ldlt().solve(d)); }

Innovation Innovation::widened(double sigma) const {
  Innovation wide = *this;
  wide.S.diagonal().array() += sigma * sigma;
  return wide;
}

}  // namespace rio_t
