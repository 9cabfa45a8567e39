"""The options of `simulate` that the tests of its library do not see."""
import pytest

from rio_t import programs


@pytest.fixture(name="simulate")
def simulate_fixture(programs_folder, tmp_path):
    """Runs `simulate` with these options and returns the process and the bag's bytes, None without a bag."""
    bag = tmp_path / "simulated.bag"

    def run(*options):
        bag.unlink(missing_ok=True)
        done = programs.run(programs_folder / "simulate", *options, "--out", bag)
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
    _, five = simulate("--fov-elevation", 5, *flat)
    _, ten = simulate("--fov-elevation", 10, *flat)
    assert narrow == five
    assert narrow != ten


@pytest.mark.parametrize("options, named", [
    (("--preset", "tank"), ("--preset", "kart")),
    (("--motion", "easy", "--doppler-span", "-1"), ("--doppler-span", "below 0")),
    (("--motion", "easy", "--doppler-span", "3", "--doppler-step", "0.49"), ("doppler-span", "doppler-step")),
    (("--motion", "easy", "--points-min", "-1"), ("--points-min", "from 0")),
    (("--motion", "easy", "--points-min", "71"), ("points-min", "points-max")),
    (("--motion", "easy", "--no-elevation=1"), ("--no-elevation", "takes no value")),
    (("--motion", "easy", "--skip-empty=yes"), ("--skip-empty", "takes no value")),
    (("--motion", "easy", "--no-elevation", "--fov-elevation", "0"), ("--fov-elevation", "above 0")),
    (("--seed", "1"), ("--motion", "--trajectory", "--preset")),
])
def test_a_bad_option_is_named(simulate, options, named):
    done, bag = simulate(*options)
    assert done.returncode == 1
    assert bag is None
    for word in named:
        assert word in done.stderr


def test_help_tells_of_presets_and_options(simulate):
    done, _ = simulate("--help")
    for word in ("--preset NAME", "--points-min N", "--skip-empty", "--doppler-span M/S", "--no-elevation", "kart"):
        assert word in done.stdout
