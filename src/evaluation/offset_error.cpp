#include "rio_t/evaluation/offset_error.h"

#include <algorithm>
#include <cmath>
#include <fstream>
#include <sstream>
#include <stdexcept>

#include "rio_t/core/format.h"
#include "rio_t/evaluation/trajectory.h"

namespace rio_t {
namespace {

std::vector<std::string> split(const std::string& line) {
  std::vector<std::string> cells;
  std::istringstream in(line);
  for (std::string cell; std::getline(in, cell, ',');) {
    const std::size_t first = cell.find_first_not_of(" \t\r");
    const std::size_t last = cell.find_last_not_of(" \t\r");
    cells.push_back(first == std::string::npos ? "" : cell.substr(first, last - first + 1));
  }
  return cells;
}

double parseNumber(const std::string& cell, const std::string& column) {
  const std::optional<double> value = finiteNumber(cell);
  if (!value) throw std::invalid_argument(column + " is '" + cell + "', expected a finite number");
  return *value;
}

}  // namespace

std::vector<OffsetSample> readTimeOffsets(std::istream& in, const std::string& name) {
  std::size_t number = 1;
  const auto fail = [&name, &number](const std::string& what) {
    return std::runtime_error(name + ":" + std::to_string(number) + ": " + what);
  };
  std::string line;
  std::getline(in, line);
  const std::vector<std::string> header = split(line);
  const auto column = [&header, &fail](const std::string& key) {
    const auto found = std::find(header.begin(), header.end(), key);
    if (found == header.end()) {
      throw fail("no column '" + key + "'; expected the header `stamp,offset_s,sigma_s`");
    }
    return static_cast<std::size_t>(found - header.begin());
  };
  const std::size_t stamp = column("stamp");
  const std::size_t offset = column("offset_s");
  const std::size_t sigma = column("sigma_s");

  std::vector<OffsetSample> samples;
  while (std::getline(in, line)) {
    ++number;
    const std::vector<std::string> cells = split(line);
    if (cells.empty() || (cells.size() == 1 && cells[0].empty())) continue;
    if (cells.size() != header.size()) {
      throw fail("found " + std::to_string(cells.size()) + " columns, expected the header's " +
                 std::to_string(header.size()));
    }
    try {
      const OffsetSample sample{parseTime(cells[stamp]), parseNumber(cells[offset], "offset_s"),
                                parseNumber(cells[sigma], "sigma_s")};
      if (!(sample.sigma >= 0.0)) throw std::invalid_argument("sigma_s is below zero");
      samples.push_back(sample);
    } catch (const std::invalid_argument& error) {
      throw fail(error.what());
    }
  }
  return samples;
}

std::vector<OffsetSample> readTimeOffsets(const std::string& path) {
  std::ifstream file(path);
  if (!file) throw std::runtime_error(path + ": cannot be opened; expected a table `stamp,offset_s,sigma_s`");
  return readTimeOffsets(file, path);
}

OffsetError offsetError(const std::vector<OffsetSample>& samples, double true_offset, double skip) {
  OffsetError result;
  for (const OffsetSample& sample : samples) {
    if (sample.time - samples.front().time < skip) continue;
    const double error = sample.offset - true_offset;
    ++result.samples;
    result.mean += error;
    result.rmse += error * error;
    result.max = std::max(result.max, std::abs(error));
    result.final_error = error;
    result.final_sigma = sample.sigma;
    if (sample.sigma == 0.0) continue;
    const double normalised = std::abs(error) / sample.sigma;
    ++result.with_sigma;
    result.share_1_sigma += normalised <= 1.0 ? 1.0 : 0.0;
    result.share_2_sigma += normalised <= 2.0 ? 1.0 : 0.0;
    result.share_3_sigma += normalised <= 3.0 ? 1.0 : 0.0;
    result.mean_normalised_square += normalised * normalised;
  }
  if (result.samples == 0) {
    throw std::invalid_argument(
        formatted("no time offset remains after the first %g s of %zu samples", skip, samples.size()));
  }
  const double n = static_cast<double>(result.samples);
  result.mean /= n;
  result.rmse = std::sqrt(result.rmse / n);
  if (result.with_sigma == 0) return result;
  const double m = static_cast<double>(result.with_sigma);
  result.share_1_sigma /= m;
  result.share_2_sigma /= m;
  result.share_3_sigma /= m;
  result.mean_normalised_square /= m;
  return result;
}

}  // namespace rio_t
