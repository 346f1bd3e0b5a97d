# SPDX-License-Identifier: MIT
# Debian packages: rimwatch, librim-dev, python3-rimwatch, of what `make install` installs.

DEB_DIR = $(BUILD)/deb
DEB_MAINTAINER ?= $(shell git config user.name || echo unknown) <$(shell git config user.email || echo unknown@localhost)>
DEB_BUILD_PACKAGES := dpkg-dev fakeroot python3-dev python3-venv
# The build of the Python package, in the versions that the tests use.
DEB_PYPI = $(shell grep -E '^(nanobind|scikit-build-core|cmake|ninja)==' $(REQUIREMENTS))

.PHONY: deb deb-deps test-deb
deb-deps: deps
	$(call install_missing,$(DEB_BUILD_PACKAGES))

deb: deb-deps ## Debian packages in build/deb: rimwatch, librim-dev, python3-rimwatch (needs PyPI for the third's build)
	@rm -rf $(DEB_DIR)/root && mkdir -p $(DEB_DIR)
	@$(MAKE) --no-print-directory PREFIX=/usr DESTDIR=$(abspath $(DEB_DIR)/root) install python-objects > $(DEB_DIR)/install.txt 2>&1 || \
	  { tail -n 20 $(DEB_DIR)/install.txt; exit 1; }
	@MAINTAINER='$(DEB_MAINTAINER)' VERSION='$(VERSION)' BUILD='$(abspath $(BUILD))' PYPI='$(DEB_PYPI)' \
	  host_tools/packaging/deb.sh '$(abspath $(DEB_DIR))'

test-deb: deb ## install those packages into a fresh Debian 12 and use them (root; some 5 minutes, not part of make test)
	$(call install_missing,debootstrap lintian)
	@BUILD=$(abspath $(BUILD)) tests/packages/debian.sh $(abspath $(DEB_DIR))
