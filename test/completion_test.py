"""The bash completion of the programs."""
import pathlib
import subprocess

import pytest

HOOK = pathlib.Path(__file__).resolve().parents[1] / "env-hooks" / "50.rio_t.bash"


def complete(programs_folder, *words):
    """What is offered for the last of the words."""
    script = f"""
source {HOOK}
catkin_find() {{ case "$*" in *"--libexec rio_t "*) echo "{programs_folder}/${{!#}}" ;; *config) echo "{HOOK.parents[1]}/config" ;; esac; }}
COMP_WORDS=("$@")
COMP_CWORD=$(($# - 1))
"$FUNCTION" "$1" "${{@: -1}}" "${{@:$#-1:1}}"
printf '%s\\n' "${{COMPREPLY[@]}}"
"""
    function = "_rio_t_rosrun" if words[0] == "rosrun" else "_rio_t_complete"
    done = subprocess.run(["bash", "-c", script, "bash", *words], env={"PATH": "/usr/bin:/bin", "FUNCTION": function,
                                                                      "LD_LIBRARY_PATH": ""},
                          stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, check=False)
    assert done.returncode == 0, done.stderr
    return done.stdout.split()


@pytest.mark.parametrize("start", [("rosrun", "rio_t"), ()])
def test_options_are_offered(programs_folder, start):
    program = "rio_t_bag" if start else str(programs_folder / "rio_t_bag")
    offered = complete(programs_folder, *start, program, "--")
    assert {"--bag", "--config", "--output-dir", "--set", "--help", "--version"} <= set(offered)
    assert complete(programs_folder, *start, program, "--out") == ["--output-dir"]


def test_configurations_and_keys_are_offered(programs_folder):
    assert {"irs", "ti_mmwave"} <= set(complete(programs_folder, "rosrun", "rio_t", "rio_t_bag", "--config", ""))
    assert complete(programs_folder, "rosrun", "rio_t", "rio_t_bag", "--set", "max_time") == ["max_time_offset="]
    assert "--time-offset" in complete(programs_folder, "rosrun", "rio_t", "simulate", "--time")
