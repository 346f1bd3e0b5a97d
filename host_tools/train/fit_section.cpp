// SPDX-License-Identifier: MIT
// The model as flight sees it: its section, and predictions by the flight code.
#include <cmath>
#include <cstring>
#include <stdexcept>
#include <string>

#include "image/nominal.h"
#include "train/fit.hpp"
#include "train/fit_gate.hpp"

namespace rim {
namespace {

void put_u32(std::vector<std::uint8_t> &out, std::uint32_t v) {
  for (unsigned shift = 0; shift < 32; shift += 8) {
    out.push_back(static_cast<std::uint8_t>(v >> shift));
  }
}

void put_f32(std::vector<std::uint8_t> &out, double v) {
  const auto single = static_cast<float>(v);
  std::uint32_t bits;
  std::memcpy(&bits, &single, sizeof bits);
  put_u32(out, bits);
}

template <typename Values> void put_all(std::vector<std::uint8_t> &out, const Values &values) {
  for (Eigen::Index i = 0; i < values.rows(); ++i) {
    for (Eigen::Index j = 0; j < values.cols(); ++j) {
      put_f32(out, values(i, j));
    }
  }
}

} // namespace

std::vector<std::uint8_t> nominal_section(const NominalModel &model) {
  std::vector<std::uint8_t> out;
  const auto prototypes = static_cast<std::uint32_t>(model.prototypes.rows());
  put_u32(out, RIM_NOMINAL_LAYOUT);
  put_u32(out, static_cast<std::uint32_t>(model.centre.size()));
  put_u32(out, static_cast<std::uint32_t>(model.offset.cols()));
  put_u32(out, prototypes);
  put_u32(out, model.top);
  put_u32(out, model.order);
  put_u32(out, 0);
  put_u32(out, 0);
  put_all(out, model.centre);
  put_all(out, model.inverse_scale);
  put_all(out, model.gate_weight);
  for (std::uint32_t p = 0; p < prototypes; ++p) {
    const auto at = static_cast<Eigen::Index>(p);
    put_f32(out, model.bandwidth[at]);
    put_f32(out, model.reach[at]);
    put_f32(out, model.ln_mass[at]);
    put_u32(out, 0);
    put_all(out, model.prototypes.row(at));
    put_all(out, model.variance.row(at));
    put_all(out, model.offset.row(at));
    if (model.order != 0) {
      put_all(out, model.maps[p]);
    }
  }
  return out;
}

void predict(const NominalModel &model, const double *x, double *mean, double *sd,
             double *extrapolation) {
  const Eigen::Index d = model.centre.size();
  const Matrix xs = standardised(model, Eigen::Map<const Matrix>(x, 1, d));
  Gates gates;
  gates.top = model.top;
  gates.index.resize(model.top);
  gates.weight.resize(model.top);
  Eigen::VectorXd reach_squared = Eigen::VectorXd::Constant(model.prototypes.rows(), -1.0);
  open_gates(model, xs, {0, 1}, gates, &reach_squared);
  const Eigen::Index o = model.offset.cols();
  Matrix value(model.top, o);
  Eigen::RowVectorXd sum = Eigen::RowVectorXd::Zero(o);
  Eigen::RowVectorXd variance = Eigen::RowVectorXd::Zero(o);
  for (Eigen::Index k = 0; k < value.rows(); ++k) {
    const std::size_t p = gates.index[static_cast<std::size_t>(k)];
    const double weight = gates.weight[static_cast<std::size_t>(k)];
    value.row(k) = model.offset.row(static_cast<Eigen::Index>(p));
    if (model.order != 0) {
      value.row(k) += xs.row(0) * model.maps[p].transpose();
    }
    sum += weight * value.row(k);
    variance += weight * model.variance.row(static_cast<Eigen::Index>(p));
  }
  for (Eigen::Index k = 0; model.order == 0 && k < value.rows(); ++k) {
    variance.array() +=
        gates.weight[static_cast<std::size_t>(k)] * (value.row(k) - sum).array().square();
  }
  Eigen::Map<Eigen::RowVectorXd>(mean, o) = sum;
  Eigen::Map<Eigen::RowVectorXd>(sd, o) = variance.array().sqrt();
  if (extrapolation != nullptr) {
    Eigen::Index nearest = 0;
    const double d2 = reach_squared.maxCoeff(&nearest); // only the nearest was raised from -1
    *extrapolation = std::sqrt(d2) / model.reach[nearest];
  }
}

Prediction predict_flight(const std::vector<std::uint8_t> &section, const Matrix &x) {
  rim_nominal model;
  const rim_status status = rimi_nominal_open(&model, section.data(), section.size());
  if (status != RIM_OK || static_cast<Eigen::Index>(model.inputs) != x.cols()) {
    throw std::invalid_argument(std::string("predict_flight: ") +
                                (status != RIM_OK ? rim_status_text(status) : "other inputs"));
  }
  Prediction out;
  out.mean.resize(x.rows(), model.outputs);
  out.sd.resize(x.rows(), model.outputs);
  out.extrapolation.resize(static_cast<std::size_t>(x.rows()));
  for (Eigen::Index i = 0; i < x.rows(); ++i) {
    const rim_status done =
        rimi_nominal_predict(&model, x.row(i).data(), out.mean.row(i).data(), out.sd.row(i).data(),
                            &out.extrapolation[static_cast<std::size_t>(i)]);
    if (done != RIM_OK) {
      throw std::invalid_argument("predict_flight: row " + std::to_string(i) + ": " +
                                  rim_status_text(done));
    }
  }
  return out;
}

} // namespace rim
