#!/usr/bin/env bash
# Runs a command where the workspace is sourced.
set -e
source /workspace/devel/setup.bash
exec "$@"
