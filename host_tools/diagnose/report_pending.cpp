// diagnose/report_pending.cpp - weak stand-ins that link until term.cpp, measured.cpp and
// extension.cpp are there; those then take their place. To be removed.
#include "diagnose/extension.hpp"

#define RIM_PENDING __attribute__((weak))

namespace rim::diagnose {

RIM_PENDING int Measured::find_feature(const std::string &name) const {
  for (std::size_t i = 0; i < features.size(); ++i) {
    if (features[i].name == name)
      return static_cast<int>(i);
  }
  return -1;
}

RIM_PENDING int Measured::find_channel(const std::string &name) const {
  for (std::size_t i = 0; i < channels.size(); ++i) {
    if (channels[i].name == name)
      return static_cast<int>(i);
  }
  return -1;
}

RIM_PENDING std::string expression_text(const Term &term) {
  return term.basis.empty() ? term.form : term.basis.front();
}
RIM_PENDING std::string gate_text(const Gate &) { return ""; }
RIM_PENDING std::string extension_toml(const std::vector<Term> &, const std::string &) {
  return "schema = \"rim-extension/1\"\n";
}

} // namespace rim::diagnose
