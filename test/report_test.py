"""The report from its command to its page, on a short simulated run."""
import base64
import re
import shutil
import subprocess
import sys

import numpy
import pytest
import yaml
from PIL import Image
from scipy.spatial.transform import Rotation

from rio_t import programs, tum
from rio_t.faults import injection, stream
from rio_t.plots import pyplot
from rio_t.report.figures import ESTIMATE, draw_ego_velocity, draw_trajectory
from rio_t.report.main import CHECKS, main
from rio_t.report.motion import motion, predicted_ego_velocity
from rio_t.rig import radars_of, read_config

FIGURES = ["trajectory", "errors", "velocity", "time_offset", "ego_velocity", "biases"]
PNG = b"\x89PNG\r\n\x1a\n"


@pytest.fixture
def report(programs_folder, capsys):
    """In this process: to import matplotlib takes longer than a report."""
    def run(*arguments):
        status = main([str(word) for word in ("--evaluate", programs_folder / "evaluate", *arguments)])
        told = capsys.readouterr()
        return subprocess.CompletedProcess(arguments, status, told.out, told.err)
    return run


@pytest.fixture
def run_folder(simulated_run, tmp_path):
    """A copy, free to be broken."""
    return shutil.copytree(simulated_run / "run", tmp_path / "run")


def page_of(done):
    assert done.returncode == 0, done.stderr
    with open(done.stdout.strip(), encoding="utf-8") as file:
        return file.read()


def cell_after(page, label):
    """The first cell beside `label` in a table."""
    return re.search(rf"<td>{re.escape(label)}</td><td[^>]*>([^<]*)</td>", page).group(1)


def figures_of(page):
    return dict(re.findall(r'<img alt="(\w+)" src="data:image/png;base64,([^"]+)">', page))


def test_page_holds_its_figures_and_numbers(report, run_folder, simulated_run, programs_folder, tmp_path):
    truth = simulated_run / "truth.txt"
    page = page_of(report("--ground-truth", truth, "--true-offset", 0.03, "--output-dir", tmp_path / "out", run_folder))
    figures = figures_of(page)
    assert list(figures) == FIGURES
    for name, data in figures.items():
        image = base64.b64decode(data)
        assert image == (tmp_path / "out" / f"{name}.png").read_bytes()
        assert image.startswith(PNG) and len(image) > 10000, name

    summary = yaml.safe_load((run_folder / "summary.yaml").read_text())
    assert float(cell_after(page, "final_offset_s")) == pytest.approx(summary["final_offset_s"], rel=1e-5)
    assert cell_after(page, "scans_used") == str(summary["scans_used"])
    assert "<h2>Is this run good?</h2>" in page and '<p class="good">This run is good' in page
    assert cell_after(page, "the estimate started") == "1"
    evaluated = programs.output_of(programs_folder / "evaluate", "--yaml", truth, run_folder / "trajectory_optimized.txt")
    ate = yaml.safe_load(evaluated)["estimates"][0]["ape_origin_m"]["rmse"]
    assert cell_after(page, "ATE: position, origin aligned, rmse [m]") == f"{ate:.4f}"
    error = 1e3 * (summary["final_offset_s"] - 0.03)
    assert float(cell_after(page, "last estimate minus truth [ms]").split()[0]) == pytest.approx(error, abs=2e-3)


def test_each_check_of_a_run_has_a_text(run_folder):
    summary = yaml.safe_load((run_folder / "summary.yaml").read_text())
    assert [check["name"] for check in summary["checks"]] == list(CHECKS)


def test_an_offset_that_is_not_estimated_has_no_sigma(report, run_folder, recwarn):
    table = run_folder / "time_offset.csv"
    header, *rows = table.read_text(encoding="utf-8").splitlines()
    sigma = header.split(",").index("sigma_s")
    cells = [row.split(",") for row in rows]
    table.write_text("\n".join([header] + [",".join(row[:sigma] + ["0"] + row[sigma + 1:]) for row in cells]) + "\n",
                     encoding="utf-8")
    page = page_of(report("--true-offset", 0.03, run_folder))
    assert list(figures_of(page)).count("time_offset") == 1
    assert "rmse [ms]" in page and "within 1, 2, 3 sigma" not in page
    assert not recwarn.list


def test_animation_covers_the_run(report, run_folder, tmp_path):
    page_of(report("--true-offset", 0.03, "--output", tmp_path / "out", "--animation", tmp_path / "run.gif", run_folder))
    with Image.open(tmp_path / "run.gif") as image:
        assert image.format == "GIF" and image.n_frames > 60
        first = image.convert("RGB").tobytes()
        image.seek(image.n_frames - 1)
        assert image.convert("RGB").tobytes() != first
    assert (tmp_path / "run.gif").stat().st_size < 2e6


def test_animation_of_another_kind_is_refused(report, run_folder, tmp_path):
    done = report("--output", tmp_path / "out", "--animation", tmp_path / "run.mp4", run_folder)
    assert done.returncode == 1 and "run.mp4: expected a name that ends in .gif" in done.stderr
    assert (tmp_path / "out" / "report.html").is_file(), "the page does not need it"


def test_each_of_two_radars_has_its_sections(report, two_radar_run, simulated_run, tmp_path):
    page = page_of(report("--ground-truth", simulated_run / "truth.txt", "--true-offset", "left=0.03", "--true-offset",
                          "right=0.05", "--output-dir", tmp_path / "out", two_radar_run / "run"))
    assert list(figures_of(page)) == ["trajectory", "errors", "velocity", "time_offset_left", "extrinsics_left",
                                      "ego_velocity_left", "time_offset_right", "extrinsics_right",
                                      "ego_velocity_right", "biases"]
    summary = yaml.safe_load((two_radar_run / "run" / "summary.yaml").read_text())
    after = page.split("Time offset against the truth: right")[1]
    error = 1e3 * (summary["final_offset_s_right"] - 0.05)
    assert float(cell_after(after, "last estimate minus truth [ms]").split()[0]) == pytest.approx(error, abs=2e-3)
    assert "mounting as estimated at the end" in page

    def rotation(key):
        return Rotation.from_quat(summary[f"{key}_extrinsics_rotation_xyzw_right"])
    turn = numpy.degrees((rotation("final") * rotation("configured").inv()).as_rotvec())
    section = page.split("<h2>Extrinsics: right")[1]
    for axis, expected in zip("xyz", turn):
        assert float(cell_after(section, f"turn about {axis} [deg]")) == pytest.approx(expected, abs=2e-3)
    assert "lever arm along" not in page  # only the rotation is estimated


def test_a_lever_arm_that_is_estimated_is_shown(report, two_radar_run, tmp_path):
    folder = shutil.copytree(two_radar_run / "run", tmp_path / "run")
    header, *lines = (folder / "extrinsics_left.csv").read_text().splitlines()
    rows = [line.split(",") for line in lines]
    for row in rows:
        row[1:4], row[8:11] = ["0.05", "0.03", "-0.06"], ["0.01"] * 3  # told x is 0.03
    (folder / "extrinsics_left.csv").write_text("\n".join([header] + [",".join(row) for row in rows]) + "\n")
    section = page_of(report(folder)).split("<h2>Extrinsics: left")[1]
    assert cell_after(section, "lever arm along x [mm]") == "20.0"
    assert cell_after(section, "lever arm along y [mm]") == "0.0"


def test_extrinsics_of_a_run_that_did_not_finish_count_from_their_first(report, two_radar_run, tmp_path):
    folder = shutil.copytree(two_radar_run / "run", tmp_path / "run")
    (folder / "summary.yaml").unlink()
    page = page_of(report(folder))
    assert "from its first estimate" in page
    assert "extrinsics_right" in figures_of(page)


@pytest.mark.parametrize("words, message", [
    (["0.03"], "expected NAME=S with a name of left, right, got no name"),
    (["rear=0.03"], "expected NAME=S with a name of left, right, got the name rear")])
def test_a_true_offset_names_its_radar(report, two_radar_run, words, message):
    refused(report("--true-offset", *words, two_radar_run / "run"), message)


def test_one_radar_has_no_name(report, run_folder):
    refused(report("--true-offset", "left=0.03", run_folder), "expected S, since there is one radar")


def test_the_mounting_of_each_radar_comes_from_its_section(programs_folder, tmp_path):
    (tmp_path / "config.yaml").write_text(
        "extrinsics_translation: [1, 2, 3]\nextrinsics_rotation_xyzw: [0, 0, 0, 1]\nradars: [left, right]\n"
        "left: {radar_topic: /left, extrinsics_translation: [4, 5, 6]}\nright: {radar_topic: /right}\n")
    radars = radars_of(read_config(programs_folder, tmp_path / "config.yaml"))
    assert [(name, lever.tolist()) for name, lever, _ in radars] == [("left", [4, 5, 6]), ("right", [1, 2, 3])]
    assert all(rotation.magnitude() == 0 for _, _, rotation in radars)


def test_a_program_may_be_given_from_its_folder(run_folder, simulated_run, programs_folder, monkeypatch, tmp_path, capsys):
    monkeypatch.chdir(programs_folder)
    for name in ("evaluate", "./evaluate"):
        status = main(["--evaluate", name, "--ground-truth", str(simulated_run / "truth.txt"), "--config", "irs",
                       "--output-dir", str(tmp_path / "out"), str(run_folder)])
        assert status == 0, capsys.readouterr().err


def test_programs_may_be_in_the_current_folder(monkeypatch, tmp_path):
    (tmp_path / "told").write_text("#!/bin/sh\necho told\n")
    (tmp_path / "told").chmod(0o755)
    monkeypatch.chdir(tmp_path)
    for given in (".", "./", tmp_path):
        assert programs.output_of(programs.find(["told"], "--programs DIR", given) / "told") == "told\n"


def test_scans_that_give_only_points_are_used():
    scans = 40
    table = {name: numpy.zeros(scans) for name in ("vx", "vy", "vz")}
    table.update({name: numpy.full(scans, 0.1) for name in ("sigma_x", "sigma_y", "sigma_z")})
    table.update(time=0.1 * numpy.arange(scans), points=numpy.full(scans, 9.0), inliers=numpy.full(scans, 7.0),
                 status=numpy.array(["moving", "points_only", "innovation", "zero_velocity"] * (scans // 4)))
    figure = draw_ego_velocity(table, None)
    labels = [text for axes in figure.axes for text in axes.get_legend_handles_labels()[1]]
    pyplot.close(figure)
    assert "innovation (10)" in labels and not any("points_only" in label for label in labels)


def walk(times):
    """Poses of a smooth walk without turns: 0.5 m/s along x, and 1 m/s at most along y."""
    position = numpy.stack([0.5 * times, 0.5 * numpy.sin(2 * times), 0 * times], -1)
    return tum.Trajectory((1e9 * times).astype(numpy.int64), position, numpy.tile([0.0, 0, 0, 1], (len(times), 1)))


def test_rest_does_not_change_the_mounting_that_is_fitted():
    t, rng = numpy.arange(0, 40, 0.05), numpy.random.RandomState(1)
    moves = numpy.arange(len(t)) % 20 >= 11  # 9 of 20 scans
    v_I = numpy.where(moves[:, None], rng.normal(size=(len(t), 3)), 0.0)
    mounting = Rotation.from_euler("xyz", [10, 20, 60], degrees=True)
    measured = mounting.apply(v_I, inverse=True) + numpy.where(moves[:, None], rng.normal(0, 0.03, (len(t), 3)), 0.0)
    scans = {"status": numpy.where(moves, "moving", "zero_velocity"), **dict(zip(("vx", "vy", "vz"), measured.T))}
    predicted, how = predicted_ego_velocity(scans, t, (t, v_I, 0 * v_I), None, "fitted")
    assert how == "mounting fitted"
    assert numpy.sqrt(numpy.mean((measured - predicted)[moves] ** 2)) < 0.1


def test_sparse_poses_have_no_velocity():
    for rate, known in ((100, True), (10, True), (5, False), (2, False)):
        t = numpy.arange(0, 20, 1 / rate)
        assert (motion(t, walk(t)) is not None) == known, rate


def test_a_gap_has_no_velocity():
    t = numpy.arange(0, 20, 0.02)
    t = t[(t < 8) | (t > 11)]
    at, v_I, omega_I = motion(t, walk(t))
    nothing = numpy.isnan(v_I).any(axis=1)
    assert nothing.any() and numpy.all(numpy.abs(at[nothing] - 9.5) < 1.6)
    assert numpy.array_equal(nothing, numpy.isnan(omega_I).any(axis=1))
    assert v_I[~nothing, 1] == pytest.approx(numpy.cos(2 * at[~nothing]), abs=0.01)
    scans = {name: numpy.zeros(3) for name in ("vx", "vy", "vz")}
    mounting = (numpy.zeros(3), Rotation.from_quat([0, 0, 0, 1]))
    predicted, _ = predicted_ego_velocity(scans, numpy.array([7.0, 9.5, 12.0]), (at, v_I, omega_I), mounting, "known")
    assert numpy.isnan(predicted[:, 0]).tolist() == [False, True, False]


def test_poses_whose_clock_goes_back_have_no_velocity():
    t = numpy.arange(0, 20, 0.02)
    assert motion(numpy.where(t > 10, t - 5, t), walk(t)) is None


def test_landmarks_do_not_set_the_view():
    def views(landmarks):
        figure = draw_trajectory([("online", ESTIMATE, walk(numpy.arange(0, 20, 0.1)).position)], landmarks)
        figure.canvas.draw()
        pyplot.close(figure)
        return [(*axes.get_xlim(), *axes.get_ylim()) for axes in figure.axes]
    far = numpy.array([-300.0, 300.0])
    assert views({"x": far, "y": far, "z": far}) == views(None)


def test_landmarks_are_drawn_in_their_own_world_only(report, run_folder, simulated_run):
    (run_folder / "map.csv").write_text("id,x,y,z,sigma,snr_db,sightings\n1,1,2,3,0.1,10,5\n")
    alone = figures_of(page_of(report(run_folder)))["trajectory"]
    page = page_of(report("--ground-truth", simulated_run / "truth.txt", run_folder))
    assert "Without the landmarks" in page
    (run_folder / "map.csv").unlink()
    without = page_of(report("--ground-truth", simulated_run / "truth.txt", run_folder))
    assert figures_of(page)["trajectory"] == figures_of(without)["trajectory"]
    assert alone != figures_of(page_of(report(run_folder)))["trajectory"]


def test_a_run_that_starts_again_is_not_judged(report, simulated_run, programs_folder, tmp_path):
    messages = stream.read(simulated_run / "run.bag", (("/sensor_platform/imu", "imu"), ("/sensor_platform/radar/scan", "radar")))
    site = injection.Site(messages[0].record, 14.0, 14.0, None)
    stream.write(tmp_path / "back.bag", injection.clock_jump(-5.0, record=False)(messages, site))
    folder = tmp_path / "run"
    programs.output_of(programs_folder / "rio_t_bag", "--bag", tmp_path / "back.bag", "--config", "irs", "--output-dir", folder)
    stamps = tum.read(folder / "trajectory.txt").stamp
    assert (numpy.diff(stamps) < 0).any(), "the test needs stamps that go back"
    for truth in ([], ["--ground-truth", simulated_run / "truth.txt"]):
        page = page_of(report(*truth, folder))
        assert ("Not judged: the estimate starts again" in page) == bool(truth)
        assert "ATE: position" not in page and "velocity" not in figures_of(page)
        assert "Radar minus what" not in page


def test_the_tracks_of_a_batch_have_its_name(report, simulated_run, programs_folder, tmp_path):
    folder, truth = tmp_path / "run", simulated_run / "truth.txt"
    programs.output_of(programs_folder / "rio_t_bag", "--bag", simulated_run / "run.bag", "--config", "irs", "--output-dir",
                       folder, "--set", "mode=batch")
    page = page_of(report("--ground-truth", truth, folder))
    assert re.search(r'<th class="number">batch, nodes</th><th class="number">batch</th>', page)
    assert "the whole bag solved at once" in page and "live user" not in page


def test_without_truth_nothing_is_evaluated(report, run_folder):
    page = page_of(report(run_folder))
    assert list(figures_of(page)) == [name for name in FIGURES if name != "errors"]
    assert "mounting fitted to the data" in page
    assert "Accuracy" not in page


def test_the_mounting_comes_from_the_configuration(report, run_folder, scripts, tmp_path):
    (tmp_path / "words.yaml").write_text("mounting_yaw_pitch_roll_deg: [10, 0, 0]\n")
    (tmp_path / "named.yaml").write_text("radars: [left]\nleft: {mounting_yaw_pitch_roll_deg: [10, 0, 0]}\n")
    for config in ("irs", scripts.parent / "config/irs.yaml", tmp_path / "words.yaml", tmp_path / "named.yaml"):
        assert "mounting from the configuration" in page_of(report("--config", config, run_folder))


def test_a_mounting_that_comes_from_tf_is_fitted(report, run_folder, tmp_path):
    (tmp_path / "tf.yaml").write_text("extrinsics_source: tf\n")
    page = page_of(report("--config", tmp_path / "tf.yaml", run_folder))
    assert "mounting fitted to the data, since the configuration takes it from tf" in page


def test_the_online_poses_stand_in_for_few_optimised_ones(report, run_folder):
    poses = run_folder / "trajectory_optimized.txt"
    poses.write_text("".join(poses.read_text().splitlines(keepends=True)[::3]))
    assert "Radar minus what the online trajectory predicts" in page_of(report(run_folder))


@pytest.mark.parametrize("name, figure", [("time_offset.csv", "time_offset"), ("ego_velocity.csv", "ego_velocity"),
                                          ("biases.csv", "biases")])
def test_an_absent_table_is_left_out(report, run_folder, name, figure):
    (run_folder / name).unlink()
    assert figure not in figures_of(page_of(report(run_folder)))


def test_a_run_that_did_not_finish_says_so(report, run_folder):
    for name in ("summary.yaml", "trajectory_optimized.txt"):
        (run_folder / name).unlink()
    page = page_of(report(run_folder))
    assert "No summary.yaml: the run did not finish." in page
    assert "trajectory" in figures_of(page)


def test_a_run_that_never_initialised_says_so(report, run_folder):
    for name in ("trajectory.txt", "trajectory_optimized.txt"):
        (run_folder / name).write_text("")
    assert "No poses: the estimator never initialised." in page_of(report(run_folder))


def test_a_run_that_was_refused_says_so(report, run_folder):
    (run_folder / "summary.yaml").unlink()
    for file in run_folder.iterdir():
        if file.is_file():
            file.write_text("")
    page = page_of(report(run_folder))
    assert "No summary.yaml: the run did not finish." in page
    assert not figures_of(page)


@pytest.mark.parametrize("name, content, message", [
    ("trajectory.txt", None, "trajectory.txt: missing; expected the output folder of rio_t_bag"),
    ("trajectory.txt", "1 2 3\n", "trajectory.txt:1: expected `stamp x y z qx qy qz qw`"),
    ("time_offset.csv", "stamp,offset_s\n", "time_offset.csv:1: no column 'sigma_s'"),
    ("biases.csv", "stamp,bgx,bgy,bgz,bax,bay,baz\n1,2,3,4,5,6,\n", "biases.csv:2: baz is '', expected a number"),
    ("summary.yaml", "a: [1\n", "summary.yaml: ")])
def test_a_broken_file_is_told_in_one_line(report, run_folder, name, content, message):
    if content is None:
        (run_folder / name).unlink()
    else:
        (run_folder / name).write_text(content)
    refused(report(run_folder), message)


@pytest.mark.parametrize("option, content, message", [
    ("--ground-truth", None, "no such file; expected a trajectory (TUM format)"),
    ("--ground-truth", "1 2\n", "given:1: expected `stamp x y z qx qy qz qw`"),
    ("--config", None, "no such file"),
    ("--config", "extrinsics_translation: [1, 2]\n", "extrinsics_translation: expected [], or a list of 3 finite numbers"),
    ("--output-dir", "a file", "cannot be made")])
def test_a_wrong_option_is_told_in_one_line(report, run_folder, tmp_path, option, content, message):
    if content is not None:
        (tmp_path / "given").write_text(content)
    refused(report(option, tmp_path / "given", run_folder), message)


def test_an_absent_run_is_told_in_one_line(scripts, tmp_path):
    refused(programs.run(sys.executable, scripts / "report.py", tmp_path / "absent"),
            "no such folder; expected the output folder of rio_t_bag")


def test_a_truth_of_another_time_is_told(report, run_folder, tmp_path):
    (tmp_path / "truth").write_text("1 0 0 0 0 0 0 1\n2 0 0 0 0 0 0 1\n")
    assert report("--ground-truth", tmp_path / "truth", run_folder).returncode == 1


def test_a_sparse_truth_has_no_velocity(report, run_folder, simulated_run, tmp_path):
    poses = (simulated_run / "truth.txt").read_text().splitlines()[2400:7201:2400]  # of 6, 12 and 18 s
    (tmp_path / "truth").write_text("\n".join(poses) + "\n")
    page = page_of(report("--ground-truth", tmp_path / "truth", run_folder))
    assert list(figures_of(page)) == FIGURES


def refused(done, message):
    assert done.returncode == 1
    assert message in done.stderr
    assert done.stderr.startswith("report.py: ") and done.stderr.count("\n") == 1, done.stderr
    assert done.stdout == ""


def test_a_bad_run_says_why(report, run_folder):
    summary = run_folder / "summary.yaml"
    content = yaml.safe_load(summary.read_text())
    content["verdict"] = "bad"
    content["checks"][1].update(value=0.1, good=False)
    content["causes"] = [{"name": "contradicts_imu", "share": 0.9, "text": "90 of 100 scans contradict.", "remedy": "Turn it."}]
    summary.write_text(yaml.safe_dump(content))
    page = page_of(report(run_folder))
    assert '<p class="bad">This run is bad' in page
    assert '<td class="number bad">0.1</td><td>at least 0.5</td>' in page
    assert "90 of 100 scans contradict. Turn it." in page
    summary.unlink()
    assert '<p class="bad">The run did not finish.' in page_of(report(run_folder))
