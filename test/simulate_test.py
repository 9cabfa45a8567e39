"""The options of `simulate` that the tests of its library do not see."""
import pytest

from rio_t import programs, run_folder


@pytest.fixture(name="simulate")
def simulate_fixture(programs_folder, tmp_path):
    """Runs `simulate` with these options and returns the process and the bag's bytes, None without a bag. Fails if it
    `fails` and shall not, or the other way round."""
    bag = tmp_path / "simulated.bag"

    def run(*options, fails=False):
        bag.unlink(missing_ok=True)
        done = programs.run(programs_folder / "simulate", *options, "--out", bag)
        assert (done.returncode != 0) == fails, done.stderr
        return done, bag.read_bytes() if bag.exists() else None
    return run


def test_options_change_a_preset_wherever_it_stands(simulate):
    _, preset = simulate("--preset", "kart", "--duration", 20)
    _, before = simulate("--points", 12, "--preset", "kart", "--duration", 20)
    _, after = simulate("--preset=kart", "--duration", 20, "--points", 12)
    assert before == after
    assert before != preset


def test_a_preset_brings_its_motion_and_another_may_be_given(simulate):
    own, _ = simulate("--preset", "kart")
    assert "motion: 90.00 s (rest 2.00 s at the start" in own.stdout
    other, _ = simulate("--preset", "kart", "--motion", "easy", "--duration", 30)
    assert "motion: 30.00 s (rest 2.00 s at the start" in other.stdout


def test_a_flat_radar_has_a_narrow_view_unless_one_is_given(simulate):
    flat = ("--motion", "ground_vehicle", "--duration", 25, "--no-elevation")
    _, narrow = simulate(*flat)
    _, five = simulate("--fov-elevation-deg", 5, *flat)
    _, ten = simulate("--fov-elevation-deg", 10, *flat)
    assert narrow == five
    assert narrow != ten


def test_ambiguous_points_do_no_harm(simulate, programs_folder, tmp_path):
    def mean_error(*options):
        errors = []
        for seed in (1, 2):
            simulate("--preset", "kart", "--seed", seed, "--time-offset", 0.03, "--ground-truth", tmp_path / "truth.txt",
                     *options)
            programs.output_of(programs_folder / "rio_t_bag", "--bag", tmp_path / "simulated.bag", "--config", "sparse",
                               "--output-dir", tmp_path / "run", "--set", f"ground_truth={tmp_path / 'truth.txt'}")
            errors.append(run_folder.read_yaml(tmp_path / "run/summary.yaml")["ate_m"])
        return sum(errors) / len(errors)
    # 1.64 times, if they count.
    assert mean_error("--ambiguous", 0.15) < 1.2 * mean_error()


def test_no_program_overwrites_what_it_reads(simulate, programs_folder, simulated_run, tmp_path):
    done, bag = simulate("--motion", "easy", "--duration", 20, "--ground-truth", tmp_path / "." / "simulated.bag",
                         fails=True)
    assert (done.returncode, bag) == (2, None)
    assert "--ground-truth" in done.stderr and "expected another file" in done.stderr
    trajectory = tmp_path / "trajectory.txt"
    trajectory.write_bytes((simulated_run / "truth.txt").read_bytes())
    done, _ = simulate("--trajectory", trajectory, "--ground-truth", trajectory, fails=True)
    assert done.returncode == 2 and "expected another file than" in done.stderr
    done = programs.run(programs_folder / "evaluate", simulated_run / "truth.txt", trajectory, "--errors", trajectory)
    assert done.returncode == 2 and "--errors" in done.stderr
    assert trajectory.read_bytes() == (simulated_run / "truth.txt").read_bytes()


RADARS = ("--motion", "easy", "--duration", "25", "--radar")


def test_a_radar_takes_from_outside_what_it_leaves_out(simulate):
    outside = ("--time-offset", 0.03, "--blackout", "16,1", "--no-elevation", "--time-offset-step", "20,0.1")
    _, bag = simulate(*outside, *RADARS, "left", "--radar", "right time-offset=0.1 blackout=18,2 fov-elevation-deg=20")
    common = "time-offset-step=20,0.1 no-elevation"
    _, spelled = simulate(*RADARS, f"right time-offset=0.1 blackout=18,2 fov-elevation-deg=20 {common}",
                          "--radar", f"left time-offset=0.03 blackout=16,1 {common}")
    assert bag == spelled
    _, otherwise = simulate(*RADARS, f"right time-offset=0.1 blackout=18,2 fov-elevation-deg=20 {common}",
                            "--radar", f"left time-offset=0.03 blackout=16,2 {common}")
    assert bag != otherwise


def test_options_may_be_repeated_within_a_radar(simulate):
    done, twice = simulate(*RADARS, "left blackout=16,1 blackout=18,1 ghost-burst=20,1 ghost-burst=22,1")
    assert "radar left: 230 scans of 250 triggers" in done.stdout
    _, once = simulate(*RADARS, "left blackout=16,1 blackout=18,1 ghost-burst=20,1")
    assert twice != once


def test_each_radar_has_its_offset_in_the_summary(simulate):
    done, _ = simulate("--noise-free", *RADARS, "left time-offset=-0.009 radar-rate=12", "--radar",
                       "right time-offset=0.04 time-offset-step=20,0.1")
    assert "radar left: 300 scans of 300 triggers" in done.stdout
    assert "true time offset: -0.009000 s" in done.stdout
    assert "true time offset: 0.040000 s at the start, 0.140000 s at the end" in done.stdout


def test_a_pair_of_a_preset_may_be_changed(simulate):
    pair = ("--preset", "kart_pair", "--duration", 20)
    done, plain = simulate(*pair)
    assert "radar left: " in done.stdout and "radar right: " in done.stdout
    _, again = simulate(*pair)
    assert plain == again
    _, outside = simulate("--time-offset", 0.03, *pair)
    _, both = simulate(*pair, "--radar", "left time-offset=0.03", "--radar", "right time-offset=0.03")
    assert outside == both != plain
    done, one = simulate(*pair, "--radar", "left ghost-burst=5,3", "--radar", "rear time-offset=0.07")
    assert one != plain
    assert [line.split(":")[0] for line in done.stdout.splitlines() if line.startswith("radar ")] == [
        "radar left", "radar rear", "radar right"]


@pytest.mark.parametrize("options, named", [
    (("--preset", "tank"), ("--preset", "kart")),
    (("--motion", "dance"), ("'dance'", "difficult")),
    (("--motion", "easy", "--doppler-span", "-1"), ("--doppler-span", "below 0")),
    (("--motion", "easy", "--doppler-span", "3", "--doppler-step", "0.49"), ("doppler-span", "doppler-step")),
    (("--motion", "easy", "--points-min", "-1"), ("--points-min", "from 0")),
    (("--motion", "easy", "--points-min", "71"), ("points-min", "points-max")),
    (("--motion", "easy", "--min-range", "20"), ("min-range", "max-range")),
    (("--motion", "easy", "--fov-azimuth-deg", "91"), ("fov-azimuth-deg", "90")),
    (("--motion", "easy", "--fov-elevation-deg", "91"), ("fov-elevation-deg", "90")),
    (("--motion", "easy", "--no-elevation=1"), ("--no-elevation", "does not take")),
    (("--motion", "easy", "--skip-empty=yes"), ("--skip-empty", "does not take")),
    (("--motion", "easy", "--no-elevation", "--fov-elevation-deg", "0"), ("--fov-elevation-deg", "above 0")),
    (("--motion", "easy", "--ghost-burst", "5,0"), ("--ghost-burst", "positive duration")),
    (("--seed", "1"), ("--motion", "--trajectory", "--preset")),
    (RADARS + ("left time-ofset=0.1",), ("--radar", "left", "unrecognised option '--time-ofset")),
    (RADARS + ("left seed=3",), ("--radar", "left", "unrecognised option '--seed")),
    (RADARS + ("left radar-rate=0",), ("--radar", "left", "radar-rate", "above 0")),
    (RADARS + ("left radar-rate",), ("--radar", "left", "'--radar-rate'", "missing")),
    (RADARS + ("left no-elevation=1",), ("--radar", "left", "no-elevation", "does not take")),
    (RADARS + ("left points=3 points=4",), ("--radar", "left", "points", "more than once")),
    (RADARS + ("left doppler-span=3 doppler-step=0.49",), ("'left'", "doppler-span", "doppler-step")),
    (RADARS + ("left latency=1e300",), ("'left'", "latency", "at most 1e6 s")),
    (RADARS + ("left", "--radar", "left time-offset=0.1"), ("--radar", "two radars", "'left'")),
    (RADARS + ("Left",), ("'Left'", "lower case")),
    (RADARS + ("time-offset=0.1",), ("'time-offset=0.1'", "lower case")),
    (RADARS + ("",), ("--radar", "expected a value")),
])
def test_a_bad_option_is_named(simulate, options, named):
    done, bag = simulate(*options, fails=True)
    assert done.returncode == 2
    assert bag is None
    for word in named:
        assert word in done.stderr


@pytest.mark.parametrize("option, value", [
    ("imu-rate", "1e15"), ("imu-rate", "1e300"), ("radar-rate", "1e300"), ("barometer-rate", "1e300"),
    ("ground-truth-rate", "1e300"), ("ground-truth-file-rate", "1e300"), ("duration", "1e300"), ("record-offset", "1e12"),
    ("record-offset", "-1.7e9"), ("start-time", "5e-324"), ("start-time", "1e300"), ("time-offset", "1e300"),
    ("time-offset", "-301"), ("time-offset-drift", "1e300"), ("time-offset-step", "5,1e300"), ("first-trigger", "1e9")])
def test_what_would_never_end_or_fit_is_refused(simulate, tmp_path, option, value):
    done, bag = simulate("--motion", "easy", "--barometer", "--ground-truth", tmp_path / "truth.txt", f"--{option}={value}",
                         fails=True)
    assert (done.returncode, bag) == (2, None), done.stderr
    assert f"--{option}" in done.stderr and "expected" in done.stderr
    assert len(done.stderr) < 300


def test_help_tells_of_presets_and_options(simulate):
    done, _ = simulate("--help")
    for word in ("--preset NAME", "--points-min N", "--skip-empty", "--doppler-span M/S", "--no-elevation", "kart", "--radar TEXT",
                 "--ghost-burst S,S", "--first-trigger S", "kart_pair", "its own reflectors, persons and"):
        assert word in done.stdout


def test_a_barometer_and_its_shocks(simulate):
    motion = ("--motion", "drone", "--duration", "25")
    _, without = simulate(*motion)
    done, calm = simulate(*motion, "--barometer")
    assert "barometer: 1250 samples, true drift at the end" in done.stdout
    assert b"sensor_msgs/FluidPressure" in calm and b"sensor_msgs/FluidPressure" not in without
    _, shocked = simulate(*motion, "--barometer", "--pressure-shock", "15,1,100", "--pressure-shock", "20,1,-100")
    assert shocked != calm
    failed, bag = simulate(*motion, "--pressure-shock", "15,1,100", fails=True)
    assert failed.returncode == 2 and "--pressure-shock needs --barometer" in failed.stderr and bag is None
    failed, _ = simulate(*motion, "--barometer", "--pressure-shock", "15,0,100", fails=True)
    assert failed.returncode == 2 and "a positive duration" in failed.stderr
