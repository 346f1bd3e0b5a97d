// SPDX-License-Identifier: MIT
// report/outputs.hpp - what `rim diagnose` leaves in its folder.
#pragma once

#include <string>

#include "diagnose/diagnosis.hpp"
#include "diagnose/measured.hpp"

namespace rim::diagnose {

// rim-diagnosis/1 (the fields of the design, and more beside them).
std::string diagnosis_json(const Diagnosis &diagnosis, const Measured &measured);
// log,row,finding: every row of every log's file; 0 where no finding acts, else the first that
// does.
std::string labels_csv(const Diagnosis &diagnosis, const Measured &measured);
// One self-contained page: no script or font from elsewhere; whole without scripts.
std::string report_html(const Diagnosis &diagnosis, const Measured &measured);

// Writes diagnosis.json, labels.csv, extension.toml and report.html, all or none: into a folder
// beside DIR that is then renamed; DIR may exist only if it is empty or holds an earlier diagnosis.
// DataError with path and reason.
void write_outputs(const Diagnosis &diagnosis, const Measured &measured, const std::string &folder);

} // namespace rim::diagnose
