// Copyright 2026 The geomsrv authors
// SPDX-License-Identifier: Apache-2.0
// Checks that are too slow in numpy; the Python layer words the errors.
#include <algorithm>
#include <bit>
#include <cmath>

#include "bind/arrays.hpp"
#include "bind/module.hpp"
#include "geom/shape.hpp"

namespace geomsrv::bind {

namespace {

/// Index of the first NaN or infinity, or -1.
std::int64_t first_nonfinite(const double* values, std::size_t count) {
    // All exponent bits set means infinity or NaN.  Whole blocks are tested without a branch, so the loop
    // vectorises.
    constexpr std::uint64_t kExponent = 0x7ff0'0000'0000'0000;
    constexpr std::size_t kBlock = 1024;
    for (std::size_t begin = 0; begin < count; begin += kBlock) {
        const std::size_t end = std::min(begin + kBlock, count);
        std::uint64_t bad = 0;
        for (std::size_t i = begin; i < end; ++i) {
            // x - x is 0 for finite x and NaN otherwise; OR-ing bit patterns keeps it exact and branch-free.
            bad |= std::bit_cast<std::uint64_t>(values[i] - values[i]);
        }
        if ((bad & kExponent) == 0) {
            continue;
        }
        for (std::size_t i = begin; i < end; ++i) {
            if ((std::bit_cast<std::uint64_t>(values[i]) & kExponent) == kExponent) {
                return static_cast<std::int64_t>(i);
            }
        }
    }
    return -1;
}

/// How far the rows of a (d, d) matrix are from unit length and right angles; NaN where they overflow.
double axes_defect(const double* rows, std::size_t d) {
    double worst = 0.0;
    for (std::size_t i = 0; i < d; ++i) {
        for (std::size_t j = 0; j <= i; ++j) {
            double product = i == j ? -1.0 : 0.0;
            for (std::size_t k = 0; k < d; ++k) {
                product += rows[i * d + k] * rows[j * d + k];
            }
            if (std::isnan(product)) return product;
            worst = std::max(worst, std::abs(product));
        }
    }
    return worst;
}

/// Index of the first matrix, and its defect, that is off by more than `limit`; or -1.
nb::tuple first_skewed(const Numbers& matrices, double limit) {
    const std::size_t d = matrices.shape(matrices.ndim() - 1);
    const std::size_t count = matrices.size() / (d * d);
    for (std::size_t i = 0; i < count; ++i) {
        const double defect = axes_defect(matrices.data() + i * d * d, d);
        if (!(defect <= limit)) return nb::make_tuple(i, defect);
    }
    return nb::make_tuple(-1, 0.0);
}

/// The same rows x y z qx qy qz qw with unit quaternions, and the index and norm of the first quaternion
/// whose norm is off by more than `limit`; or -1.
nb::tuple unit_quaternions(const Rows7& poses, double limit) {
    const std::size_t count = poses.shape(0);
    const Output<double> out = empty<double>({count, 7});
    for (std::size_t i = 0; i < count; ++i) {
        const double* const row = poses.data() + 7 * i;
        const double norm = std::sqrt(row[3] * row[3] + row[4] * row[4] + row[5] * row[5] + row[6] * row[6]);
        if (!(std::abs(norm - 1.0) <= limit)) return nb::make_tuple(out.array, i, norm);
        double* const placed = out.data + 7 * i;
        std::copy_n(row, 3, placed);
        for (std::size_t k = 3; k < 7; ++k) {
            placed[k] = row[k] / norm;
        }
    }
    return nb::make_tuple(out.array, -1, 1.0);
}

/// (n, 3, 3) of unit quaternions x y z w: from here on the numbers are taken literally.
nb::object rotation_matrices(const Rows4& quaternions) {
    const std::size_t count = quaternions.shape(0);
    const Output<double> out = empty<double>({count, 3, 3});
    for (std::size_t i = 0; i < count; ++i) {
        const double* const q = quaternions.data() + 4 * i;
        const Mat3 rotation = rotation_of(q[0], q[1], q[2], q[3]);
        for (std::size_t k = 0; k < 3; ++k) {
            const Vec3 row = rotation.row[k];
            double* const to = out.data + 9 * i + 3 * k;
            to[0] = row.x;
            to[1] = row.y;
            to[2] = row.z;
        }
    }
    return out.array;
}

}  // namespace

void define_validate(nb::module_& m) {
    m.def(
        "first_nonfinite",
        [](const Numbers& values) {
            const nb::gil_scoped_release unlocked;
            return first_nonfinite(values.data(), values.size());
        },
        nb::arg("values").noconvert());
    m.def("first_skewed", first_skewed, nb::arg("matrices").noconvert(), nb::arg("limit"));
    m.def("rotation_matrices", rotation_matrices, nb::arg("quaternions").noconvert());
    m.def("unit_quaternions", unit_quaternions, nb::arg("poses").noconvert(), nb::arg("limit"));
}

}  // namespace geomsrv::bind
