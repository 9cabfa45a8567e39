"""scripts/install_dependencies.sh on machines of many kinds: nothing is installed where it could harm."""
import os
import pty
import subprocess

import pytest

SYSTEMS = [("debian", "11"), ("debian", "12"), ("debian", "13"), ("ubuntu", "22.04")]


class Machine:
    """A machine with stand-ins for the programs that the script calls; what they were asked is in `calls`."""

    def __init__(self, folder, script):
        self.script, self.root, self.log = script, folder / "root", folder / "calls"
        self.programs = folder / "bin"
        self.programs.mkdir()
        (self.root / "etc").mkdir(parents=True)
        self.environment = {**os.environ, "PATH": f"{self.programs}:/usr/bin:/bin", "RIO_T_SYSTEM_ROOT": str(self.root)}
        self.environment.pop("ROS_DISTRO", None)
        self.program("dpkg-query", "exit 1")  # nothing is installed
        self.program("id", "echo 0")
        for name in ("apt-get", "rosdep"):
            self.program(name, f'echo {name} "$@" >>{self.log}')
        self.program("sudo", f'echo sudo >>{self.log}; exec "$@"')

    def program(self, name, text):
        path = self.programs / name
        path.write_text(f"#!/bin/sh\n{text}\n")
        path.chmod(0o755)

    def system(self, name, version):
        (self.root / "etc/os-release").write_text(f'PRETTY_NAME="A {name} {version}"\nID={name}\nVERSION_ID="{version}"\n')

    def ros(self, distribution, sourced):
        (self.root / "opt/ros" / distribution).mkdir(parents=True)
        if sourced:
            self.environment["ROS_DISTRO"] = distribution

    def run(self, *words, answer=None):
        """The completed process. `answer`: what is typed on a terminal; without it there is none."""
        if answer is None:
            return subprocess.run([self.script, *words], env=self.environment, text=True, stdin=subprocess.DEVNULL,
                                  capture_output=True, check=False)
        ours, theirs = pty.openpty()
        os.write(ours, answer.encode())
        try:
            return subprocess.run([self.script, *words], env=self.environment, text=True, stdin=theirs,
                                  capture_output=True, check=False)
        finally:
            os.close(ours)
            os.close(theirs)

    @property
    def calls(self):
        return self.log.read_text() if self.log.exists() else ""


@pytest.fixture
def machine(tmp_path, scripts):
    return Machine(tmp_path, scripts / "install_dependencies.sh")


@pytest.mark.parametrize("name, version", SYSTEMS)
def test_root_is_told_what_it_installs_and_it_goes_on(machine, name, version):
    machine.system(name, version)
    done = machine.run("clang-14")
    assert done.returncode == 0, done.stderr
    assert "librostest-dev" in done.stdout and "clang-14" in done.stdout and f"A {name} {version}" in done.stdout
    assert "sudo" not in machine.calls
    assert ("python3-ament-package" in machine.calls) == (version != "11")  # Debian 11 has no such package
    assert "apt-get update" in machine.calls and "clang-14" in machine.calls


def test_it_waits_for_the_lists_of_another_apt(machine, tmp_path):
    machine.system("debian", "12")
    machine.program("sleep", f"touch {tmp_path / 'released'}")
    machine.program("apt-get", f"""echo apt-get "$@" >>{machine.log}
[ "$1" != update ] || [ -e {tmp_path / 'released'} ] || {{ echo 'E: Could not get lock /var/lib/apt/lists/lock.' >&2; exit 100; }}""")
    done = machine.run()
    assert done.returncode == 0, done.stderr
    assert machine.calls.count("apt-get update") == 2 and "install -y" in machine.calls


def test_it_does_not_wait_for_a_mirror(machine):
    machine.system("debian", "12")
    machine.program("apt-get", f'echo apt-get "$@" >>{machine.log}; echo "E: no route to the mirror" >&2; exit 100')
    done = machine.run()
    assert done.returncode == 1 and "no route to the mirror" in done.stderr
    assert machine.calls == "apt-get update\n"


def test_nothing_is_done_if_all_is_there(machine):
    machine.system("debian", "12")
    machine.program("dpkg-query", "echo installed")
    done = machine.run()
    assert (done.returncode, done.stdout, machine.calls) == (0, "", "")


def test_without_a_terminal_sudo_is_used_without_a_question(machine):
    machine.system("debian", "12")
    machine.program("id", "echo 1000")
    assert machine.run().returncode == 0
    assert machine.calls.count("sudo") == 2


@pytest.mark.parametrize("answer", ["n\n", "\n", "\x04"])
def test_on_a_terminal_it_asks_before_sudo(machine, answer):
    machine.system("debian", "12")
    machine.program("id", "echo 1000")
    done = machine.run(answer=answer)
    assert done.returncode == 1
    assert machine.calls == ""
    assert "librostest-dev" in done.stdout


def test_on_a_terminal_it_installs_after_a_yes(machine):
    machine.system("debian", "12")
    machine.program("id", "echo 1000")
    assert machine.run(answer="y\n").returncode == 0
    assert machine.calls.count("sudo") == 2


@pytest.mark.parametrize("system, version, distribution", [("ubuntu", "20.04", "noetic"), ("ubuntu", "22.04", "one"),
                                                           ("ubuntu", "24.04", None), ("debian", "12", "noetic"),
                                                           ("fedora", "41", None)])
def test_elsewhere_nothing_changes_and_the_right_lines_are_told(machine, system, version, distribution):
    machine.system(system, version)
    if distribution:
        machine.ros(distribution, sourced=False)
    done = machine.run("clang-14")
    assert done.returncode == 3
    assert machine.calls == ""
    distribution = distribution or ("one" if version == "24.04" else "noetic")
    for line in (f"source /opt/ros/{distribution}/setup.bash", f"--ignore-src --rosdistro {distribution}", "catkin_make",
                 "also needs: clang-14"):
        assert line in done.stderr
    assert "/opt/ros, and Debian's packages" in done.stderr or f"A {system} {version}" in done.stderr


@pytest.mark.parametrize("sourced", [False, True])
def test_ros_2_is_not_touched(machine, sourced):
    machine.system("ubuntu", "22.04")
    machine.ros("humble", sourced)
    done = machine.run()
    assert (done.returncode, machine.calls) == (3, "")
    assert "needs ROS 1" in done.stderr and "ROS 2 (humble)" in done.stderr


def test_ros_1_beside_ros_2_is_taken(machine):
    machine.system("ubuntu", "22.04")
    machine.ros("humble", sourced=False)
    machine.ros("one", sourced=False)
    assert "source /opt/ros/one/setup.bash" in machine.run().stderr


def test_a_sourced_ros_that_has_everything_lets_the_build_go_on(machine):
    machine.system("ubuntu", "20.04")
    machine.ros("noetic", sourced=True)
    assert machine.run().returncode == 0
    assert "rosdep check --rosdistro noetic" in machine.calls and "apt-get" not in machine.calls


def test_a_sourced_ros_that_lacks_something_stops(machine):
    machine.system("ubuntu", "20.04")
    machine.ros("noetic", sourced=True)
    machine.program("rosdep", "exit 1")
    assert machine.run().returncode == 3
    machine.program("rosdep", "exit 0")
    done = machine.run("clang-14")
    assert done.returncode == 3 and "missing: clang-14" in done.stderr
