"""The paper's experiments and more, on simulated or given bags: tables as Markdown and CSV, figures as PNG.

  shifts      stamps shifted by 0, 2.5, ... 15 ms: the estimate must follow, online and in a batch (Fig. 4); arrival
              against trigger stamps
  delay       100 ms of delay in passes; each takes the estimate of the pass before off the stamps
  table1      RIO-T against LC-RIO, which does not estimate the offset (Table I)
  table2      LC-RIO with the stamps of the bag and with stamps corrected by RIO-T's estimate (Table II)
  montecarlo  seeds x motions x offsets: mean, spread, and whether the stated uncertainty is honest
  consistency seeds x motions: errors of position, velocity, tilt, yaw and offset, divided by their stated sigmas, at
              all times (NEES); 1 is honest, `!` marks what is below 0.5 or above 2
  platforms   seeds x motions, each run with sensors drawn at random: NEES, verdict and options of each run; `!` marks
              an estimate that is sure and wrong
  aids        seeds x motions: without an aid, with the constraint of a ground vehicle, the barometer and the landmarks,
              each alone, and with all; the error of the height, and what it costs

Both models of the offset run side by side: `imu` (ours) and `constant_acceleration` (the paper's). `consistency`,
`platforms` and `aids` run one model, that of the configuration or of --set time_offset_model=...
"""
