#!/usr/bin/env python3
"""Report of one run: src/rio_t/report/."""
import pathlib
import sys

# In a clone; elsewhere the package is where Python looks for it.
sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "src"))
from rio_t.report.main import main  # noqa: E402

sys.exit(main(sys.argv[1:]))
