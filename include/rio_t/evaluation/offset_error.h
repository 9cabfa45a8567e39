#pragma once

#include <cstddef>
#include <iosfwd>
#include <string>
#include <vector>

#include "rio_t/core/time.h"

namespace rio_t {

/// Estimate of the radar's time offset t_O, as rio_t publishes it: a scan stamped s was measured at s - t_O.
struct OffsetSample {
  Time time;
  double offset = 0.0;  ///< [s]
  double sigma = 0.0;   ///< standard deviation the estimator claims, > 0 [s]
};

/// Reads a table with the header `stamp,offset_s,sigma_s` (in any order, other columns are skipped).
/// Throws std::runtime_error naming the file, the line number and what was expected.
std::vector<OffsetSample> readTimeOffsets(const std::string& path);
/// The same from a stream; `name` stands for the file in messages.
std::vector<OffsetSample> readTimeOffsets(std::istream& in, const std::string& name);

/// Error of the estimates against a constant true offset, and whether their sigmas are consistent with it.
/// Independent Gaussian estimates with correct sigmas have shares of 0.683, 0.954 and 0.997 and a mean
/// normalised square of 1. Estimates of a filter are correlated in time, so one run scatters widely about
/// these values. Only if many runs are far from them, the sigma is wrong.
struct OffsetError {
  std::size_t samples = 0;
  std::size_t with_sigma = 0;  ///< samples with sigma > 0: only these count in the shares and the mean square
  double mean = 0.0;           ///< estimate minus truth [s]
  double rmse = 0.0;           ///< [s]
  double max = 0.0;            ///< largest magnitude [s]
  double final_error = 0.0;    ///< of the last sample [s]
  double final_sigma = 0.0;    ///< of the last sample [s]
  double share_1_sigma = 0.0;  ///< share of samples whose error is at most one sigma, in [0, 1]
  double share_2_sigma = 0.0;
  double share_3_sigma = 0.0;
  double mean_normalised_square = 0.0;  ///< mean of (error / sigma)^2
};

/// Leaves out the first `skip` seconds of the series (convergence).
/// Throws std::invalid_argument if no sample remains.
OffsetError offsetError(const std::vector<OffsetSample>& samples, double true_offset, double skip = 0.0);

}  // namespace rio_t
