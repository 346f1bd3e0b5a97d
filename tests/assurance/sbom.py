#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""sbom.py BUILD VERSION OUT: what is linked, as two documents of SPDX 2.3 (JSON): OUT/board.spdx.json of librim.a and
rimd, OUT/ground.spdx.json of rim.

What a program needs is read from it (readelf), and which Debian package that is from dpkg; what is compiled in is
listed below. A library whose package or licence is not known is an error: the list below has to name it. Nothing in
a document depends on the time but SOURCE_DATE_EPOCH, or the date of the newest change log entry."""
import datetime
import hashlib
import json
import os
import re
import subprocess
import sys

build, version, out = sys.argv[1:4]
# By Debian source package: licence as SPDX writes it, and where it comes from.
KNOWN = {
    "glibc": ("LGPL-2.1-or-later", "https://www.gnu.org/software/libc/"),
    "gcc-12": ("GPL-3.0-or-later WITH GCC-exception-3.1", "https://gcc.gnu.org/"),
    "libsodium": ("ISC", "https://libsodium.org/"),
    "lcm": ("LGPL-2.1-or-later", "https://lcm-proj.github.io/"),
    "fmtlib": ("MIT", "https://fmt.dev/"),
    "tomlplusplus": ("MIT", "https://marzer.github.io/tomlplusplus/"),
    "muparser": ("BSD-2-Clause", "https://beltoforion.de/en/muparser/"),
    "libccd": ("BSD-3-Clause", "https://github.com/danfis/libccd"),
    "zlib": ("Zlib", "https://zlib.net/"),
    "libzstd": ("BSD-3-Clause OR GPL-2.0-only", "https://facebook.github.io/zstd/"),
    "eigen3": ("MPL-2.0", "https://eigen.tuxfamily.org/"),
    "cli11": ("BSD-3-Clause", "https://github.com/CLIUtils/CLI11"),
    "nlohmann-json3": ("MIT", "https://json.nlohmann.me/"),
    "boost-defaults": ("BSL-1.0", "https://www.boost.org/"),
    "nanoflann": ("BSD-2-Clause", "https://github.com/jlblancoc/nanoflann"),
    "dygraphs": ("MIT", "https://dygraphs.com/"),
}
# Compiled in: headers, and the script of a report's plots.
INSIDE = ["libeigen3-dev", "libcli11-dev", "nlohmann-json3-dev", "libboost-dev", "libjs-dygraphs", "libnanoflann-dev"]
try:
    since = int(os.environ["SOURCE_DATE_EPOCH"])
except KeyError:
    since = int(os.path.getmtime("CHANGELOG.md"))
created = datetime.datetime.fromtimestamp(since, datetime.timezone.utc).strftime("%Y-%m-%dT%H:%M:%SZ")


def run(*command):
    return subprocess.run(command, check=True, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True).stdout


def debian(package):
    """Source and version of an installed package."""
    source, number = run("dpkg-query", "-W", "-f=${source:Package} ${Version}", package).split()
    if source not in KNOWN:
        sys.exit("sbom: the licence of %s (%s) is not known: name it in %s" % (package, source, sys.argv[0]))
    return package, source, number


def needed(program):
    """The Debian packages of the libraries that a program asks for, by their file names."""
    where = dict(re.findall(r"(\S+) => (\S+)", run("ldd", program)))
    found = {}
    for name in re.findall(r"\(NEEDED\).*\[(.*)\]", run("readelf", "-d", program)):
        path = where.get(name, name)
        for candidate in (path, os.path.realpath(path), path.replace("/lib/", "/usr/lib/", 1), "/usr" + path, "/usr" + os.path.realpath(path)):
            answer = subprocess.run(["dpkg", "-S", candidate], stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True).stdout
            if answer:
                package = answer.split(":")[0]
                found.setdefault(package, []).append(name)
                break
        else:
            sys.exit("sbom: no Debian package has %s, which %s needs" % (path, program))
    return found


def our_package(name, path, comment):
    data = open(path, "rb").read()
    return {"SPDXID": "SPDXRef-" + name, "name": name, "versionInfo": version, "supplier": "Organization: rimwatch",
            "downloadLocation": "NOASSERTION", "filesAnalyzed": False, "licenseConcluded": "MIT", "licenseDeclared": "MIT",
            "copyrightText": "NOASSERTION", "packageFileName": os.path.basename(path), "comment": comment,
            "checksums": [{"algorithm": "SHA256", "checksumValue": hashlib.sha256(data).hexdigest()}]}


def their_package(package, comment):
    name, source, number = debian(package)
    licence, home = KNOWN[source]
    return {"SPDXID": "SPDXRef-" + re.sub(r"[^A-Za-z0-9.-]", "-", name), "name": name, "versionInfo": number,
            "supplier": "Organization: Debian", "downloadLocation": home, "filesAnalyzed": False, "licenseConcluded": licence,
            "licenseDeclared": licence, "copyrightText": "NOASSERTION", "comment": comment,
            "externalRefs": [{"referenceCategory": "PACKAGE-MANAGER", "referenceType": "purl",
                              "referenceLocator": "pkg:deb/debian/%s@%s" % (name, number.replace(":", "%3A").replace("+", "%2B").replace("~", "%7E"))}]}


def document(name, programs, inside):
    packages, relations, theirs = [], [], {}
    for program, path, comment, dynamic in programs:
        package = our_package(program, path, comment)
        packages.append(package)
        relations.append(("SPDXRef-DOCUMENT", "DESCRIBES", package["SPDXID"]))
        for other, files in (needed(path) if dynamic else {}).items():
            theirs.setdefault(other, "linked dynamically: " + " ".join(sorted(files)))
            relations.append((package["SPDXID"], "DYNAMIC_LINK", "SPDXRef-" + re.sub(r"[^A-Za-z0-9.-]", "-", other)))
        if dynamic:
            relations.append((package["SPDXID"], "STATIC_LINK", "SPDXRef-librim.a"))
    for other in inside:
        theirs.setdefault(other, "compiled in")
        relations.append(("SPDXRef-" + programs[-1][0], "CONTAINS", "SPDXRef-" + other))
    if not any(p["name"] == "librim.a" for p in packages):
        packages.append(our_package("librim.a", os.path.join(build, "librim.a"), "linked statically"))
    packages += [their_package(other, comment) for other, comment in sorted(theirs.items())]
    digest = hashlib.sha256(json.dumps(packages, sort_keys=True).encode()).hexdigest()[:16]
    return {"spdxVersion": "SPDX-2.3", "dataLicense": "CC0-1.0", "SPDXID": "SPDXRef-DOCUMENT", "name": "rimwatch-%s-%s" % (version, name),
            "documentNamespace": "https://spdx.org/spdxdocs/rimwatch-%s-%s-%s" % (version, name, digest),
            "creationInfo": {"created": created, "creators": ["Tool: rimwatch-sbom-%s" % version]}, "packages": packages,
            "relationships": [{"spdxElementId": a, "relationshipType": k, "relatedSpdxElement": b} for a, k, b in sorted(set(relations))]}


os.makedirs(out, exist_ok=True)
library = ("librim.a", os.path.join(build, "librim.a"), "needs memcpy, memmove, memset, memcmp and the compiler's helpers; nothing else", False)
for name, programs, headers in (("board", [library, ("rimd", os.path.join(build, "rimd"), "the daemon for Linux", True)], []),
                                ("ground", [("rim", os.path.join(build, "rim"), "the ground tool", True)], INSIDE)):
    path = os.path.join(out, name + ".spdx.json")
    made = document(name, programs, headers)
    with open(path + ".tmp", "w") as file:
        json.dump(made, file, indent=1)
        file.write("\n")
    os.replace(path + ".tmp", path)
    print("%s: %d packages" % (path, len(made["packages"])))
