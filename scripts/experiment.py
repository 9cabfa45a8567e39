#!/usr/bin/env python3
"""The paper's experiments and more: src/rio_t/experiments/."""
import pathlib
import sys

# In a clone; elsewhere the package is where Python looks for it.
sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "src"))
from rio_t.experiments.main import main  # noqa: E402

sys.exit(main(sys.argv[1:]))
