# SPDX-License-Identifier: MIT
# Everything in data/ but make files is installed into share/rimwatch.

DATA_FILES := $(patsubst data/%,%,$(shell find data -type f ! -name Dir.mk ! -name '.*' | LC_ALL=C sort))
