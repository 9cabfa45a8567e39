// The density of a Doppler: a bin, blurred by noise.
#include "../src/radar/doppler_bin.h"

#include <gtest/gtest.h>

#include <cmath>

namespace rio_t {
namespace {

const double kSteps[] = {0.0, 0.05, 0.49};
const double kSigmas[] = {0.02, 0.1, 0.3};

double quantization(double step) { return step * step / 12.0; }

TEST(DopplerDensity, IntegratesToOne) {
  for (const double step : kSteps) {
    for (const double sigma : kSigmas) {
      double sum = 0.0;
      for (double e = -4.0; e <= 4.0; e += 0.001)
        sum += 0.001 * dopplerDensity(e, sigma * sigma, quantization(step)).value;
      EXPECT_NEAR(sum, 1.0, 1e-6) << step << " " << sigma;
    }
  }
}

TEST(DopplerDensity, HasTheRightDerivative) {
  for (const double step : kSteps) {
    for (const double sigma : kSigmas) {
      const double variance = sigma * sigma;
      const double away = 1e-4 * variance;
      for (const double e : {-0.3, -0.02, 0.0, 0.01, 0.24, 0.25, 0.5}) {
        const auto valueAt = [&](double v) { return dopplerDensity(e, v, quantization(step)).value; };
        const DopplerDensity density = dopplerDensity(e, variance, quantization(step));
        const double numeric = (valueAt(variance + away) - valueAt(variance - away)) / (2.0 * away);
        EXPECT_NEAR(density.by_variance, numeric, 1e-6 * (density.value / variance + 1.0))
            << step << " " << sigma << " " << e;
      }
    }
  }
}

/// The mean, over errors as they occur, of the squared derivative of the log density.
TEST(DopplerDensity, InformsAboutItsVarianceAsItSays) {
  for (const double step : kSteps) {
    for (const double sigma : kSigmas) {
      double mean = 0.0;
      for (double e = -4.0; e <= 4.0; e += 0.0005) {
        const DopplerDensity density = dopplerDensity(e, sigma * sigma, quantization(step));
        if (density.value > 1e-30) mean += 0.0005 * density.by_variance * density.by_variance / density.value;
      }
      // Exact at both ends. Where the bin is as wide as the noise, the formulas meet within a fifth.
      const double told = varianceInformation(sigma * sigma, quantization(step));
      EXPECT_NEAR(told, mean, 0.2 * mean) << step << " " << sigma;
    }
  }
}

}  // namespace
}  // namespace rio_t
