#pragma once

#include "rio_t/odometry/batch_odometry.h"
#include "simulated_run.h"

namespace rio_t {

/// Whole-trajectory batch over the scans of an online run.
inline BatchResult batchOf(const SimulatedRun& run) {
  BatchOdometry batch(run.options, BatchOptions());
  batch.addImu(run.taken);
  for (const ScanResult& result : run.results) batch.addResult(result);
  return batch.solve(*run.odometry->start());
}

}  // namespace rio_t
