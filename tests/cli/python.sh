#!/bin/bash
# SPDX-License-Identifier: MIT
# The Python package: built by pip as a user would, then held to the command line (test_package.py);
# the notebook executed. Skipped, saying so, where PyPI's packages are not there.
. "$(dirname "$0")/check.inc"
python=$BUILD/venv/bin/python3
skip_under_sanitizers "it builds by itself what it tests, without them"
has_packages "$python" nanobind scikit_build_core pandas sklearn ||
  skip "no nanobind, scikit-build-core, pandas, scikit-learn in $BUILD/venv"
export RIMWATCH_BUILD=$BUILD PATH=$BUILD/venv/bin:$PATH
"$python" -m pip install --quiet --no-deps --no-build-isolation --disable-pip-version-check \
  --target "$here/site" -C build-dir="$BUILD/python/test" -C cmake.define.CMAKE_CXX_FLAGS_RELEASE="-O1 -DNDEBUG" \
  -C cmake.define.CMAKE_UNITY_BUILD=ON -C cmake.define.CMAKE_UNITY_BUILD_BATCH_SIZE=0 \
  "$root/host_tools/python" > "$here/pip.txt" 2>&1 # compiled in half the time; what computes comes from $BUILD
check "pip install" 0 $? || tail -30 "$here/pip.txt"
[ -d "$here/site/rimwatch" ] || tail -30 "$here/pip.txt"
cd "$here" && mkdir files
export PYTHONPATH=$here/site OMP_NUM_THREADS=1
out=$("$python" "$root/tests/python/test_package.py" "$RIM" files 2>&1); check "test_package" 0 $?
printf '%s\n' "$out"
passed=$((passed + $(printf '%s\n' "$out" | awk 'END {print $1 + 0}')))
check "readers as a module" 0 "$("$python" -m rimwatch.readers --help > /dev/null; echo $?)"
if has_packages "$python" nbclient ipykernel; then
  cp "$root"/host_tools/python/examples/*.ipynb .
  "$python" - << 'END' > notebook.txt 2>&1
import glob
import os
import nbformat
from nbclient import NotebookClient
for name in sorted(glob.glob("*.ipynb")):
    notebook = nbformat.read(name, as_version=4)
    if not os.environ.get("RIM_LONG"):  # one cell before its own: ten runs at most, and half of a diagnosis's rows
        notebook.cells.insert(0, nbformat.v4.new_code_cell("""import rimwatch
logs, diagnose = rimwatch.example_logs, rimwatch.diagnose
rimwatch.example_logs = lambda runs, **options: logs(min(runs, 10), **options)
rimwatch.diagnose = lambda logs, **options: diagnose([log[:len(log) // 2] for log in logs], **options)"""))
    NotebookClient(notebook, timeout=120, kernel_name="python3").execute()
    text = "".join(str(o) for c in notebook.cells for o in c.get("outputs", []))
    print(name, "digest" in text, "iframe" in text, "Traceback" not in text)
END
  check "the notebook runs" 0 $?
  contains "the notebook's outputs" "$(cat notebook.txt)" "first_steps.ipynb True True True"
else
  skipped=$((skipped + 1))
fi
finish
