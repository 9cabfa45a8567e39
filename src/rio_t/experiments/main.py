"""The program: scripts/experiment.py."""
import sys

from ..errors import RioTError, UsageError
from .options import parse


def main(words):
    try:
        options = parse(words)
        if not options.check:
            from .runner import run  # late: a wrong argument is told before numpy and matplotlib are installed
            run(options, words)
    except (RioTError, OSError, ImportError) as error:
        print(f"experiment.py: {error}", file=sys.stderr)
        return 2 if isinstance(error, UsageError) else 1
    except KeyboardInterrupt:
        return 130
    return 0
