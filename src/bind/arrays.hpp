// Copyright 2026 The geomsrv authors
// SPDX-License-Identifier: Apache-2.0
// Array types that every binding shares, and how results are handed to numpy.
#pragma once

#include <nanobind/nanobind.h>
#include <nanobind/ndarray.h>
#include <sys/mman.h>

#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <functional>
#include <initializer_list>
#include <memory>
#include <new>
#include <numeric>
#include <utility>
#include <vector>

#include "geom/frustum.hpp"

namespace geomsrv::bind {

namespace nb = nanobind;

// The Python layer validates; here a wrong dtype or layout is a programming error and is refused, not copied,
// so every array argument is declared with nb::arg("...").noconvert().
template <class T, class... Shape>
using Input = nb::ndarray<const T, Shape..., nb::c_contig, nb::device::cpu>;

using Numbers = Input<double>;  // of any shape
using Values = Input<double, nb::ndim<1>>;
using Rows2 = Input<double, nb::shape<-1, 2>>;
using Rows3 = Input<double, nb::shape<-1, 3>>;
using Rows4 = Input<double, nb::shape<-1, 4>>;
using Rows6 = Input<double, nb::shape<-1, 6>>;
using Rows7 = Input<double, nb::shape<-1, 7>>;
using Rows18 = Input<double, nb::shape<-1, 18>>;
using Matrices3 = Input<double, nb::shape<-1, 3, 3>>;
using Offsets = Input<std::int64_t, nb::ndim<1>>;
using Pairs = Input<std::int64_t, nb::shape<-1, 2>>;
using Codes = Input<std::uint8_t, nb::ndim<1>>;
using Flags = Input<bool, nb::ndim<1>>;

/// As `Frustum.packed` lists it.
inline Frustum unpacked_frustum(const double* p) {
    return {.origin = {p[0], p[1], p[2]},
            .axes = {{{p[3], p[4], p[5]}, {p[6], p[7], p[8]}, {p[9], p[10], p[11]}}},
            .l0 = p[12],
            .l1 = p[13],
            .u0 = p[14],
            .u1 = p[15],
            .near = p[16],
            .far = p[17]};
}

/// A result: numpy owns the memory, `data` is where the batch loop writes (with the GIL released).
template <class T>
struct Output {
    nb::object array;
    T* data = nullptr;
};

/// Pages of this size are asked for where a result fills two of them.
inline constexpr std::size_t kHugePage = std::size_t{1} << 21;

/// Memory in whole huge pages.  The first write to a page costs a fault: with small pages, of which numpy's
/// allocator leaves some at both ends of an array, that takes longer than most kernels do.
inline void* huge_pages(std::size_t bytes) {
    const std::size_t size = (bytes + kHugePage - 1) / kHugePage * kHugePage;
    void* const memory = std::aligned_alloc(kHugePage, size);
    if (memory == nullptr) throw std::bad_alloc();
#ifdef MADV_HUGEPAGE
    ::madvise(memory, size, MADV_HUGEPAGE);  // a wish: where it is not granted, small pages serve
#endif
    return memory;
}

template <class T>
constexpr const char* dtype_name() {
    return std::is_same_v<T, double>         ? "float64"
           : std::is_same_v<T, std::int64_t> ? "int64"
           : std::is_same_v<T, std::int32_t> ? "int32"
           : std::is_same_v<T, std::int8_t>  ? "int8"
           : std::is_same_v<T, bool>         ? "bool"
                                             : "uint8";
}

/// An array to be filled.
template <class T>
Output<T> empty(std::initializer_list<std::size_t> shape) {
    static_assert(sizeof(T) == 1 || sizeof(T) == 4 || sizeof(T) == 8);
    const std::size_t bytes =
        std::accumulate(shape.begin(), shape.end(), sizeof(T), std::multiplies<std::size_t>());
    if (bytes >= 2 * kHugePage) {
        void* const memory = huge_pages(bytes);
        const nb::capsule owner(memory, [](void* p) noexcept { std::free(p); });
        const nb::ndarray<nb::numpy, T, nb::c_contig> array(memory, shape.size(), shape.begin(), owner);
        return {nb::cast(array), static_cast<T*>(memory)};
    }
    // Looked up once and kept for good: for a small answer the way to numpy takes longer than the kernel.
    static PyObject* const numpy_empty =
        nb::object(nb::module_::import_("numpy").attr("empty")).release().ptr();
    static PyObject* const dtype =
        nb::module_::import_("numpy").attr("dtype")(dtype_name<T>()).release().ptr();
    const nb::object sizes = nb::steal(PyTuple_New(static_cast<Py_ssize_t>(shape.size())));
    Py_ssize_t axis = 0;
    for (const std::size_t size : shape) {
        PyTuple_SET_ITEM(sizes.ptr(), axis++, PyLong_FromSize_t(size));
    }
    PyObject* const arguments[] = {sizes.ptr(), dtype};
    nb::object array = nb::steal(PyObject_Vectorcall(numpy_empty, arguments, 2, nullptr));
    Py_buffer view;
    if (!array.is_valid() || PyObject_GetBuffer(array.ptr(), &view, PyBUF_WRITABLE) != 0)
        nb::raise_python_error();
    T* const data = static_cast<T*>(view.buf);
    PyBuffer_Release(&view);  // the array keeps its memory
    return {array, data};
}

/// Points as an array that keeps their vector alive: copying many into fresh memory costs as much as finding
/// some.
template <class Point>
nb::object rows_of(std::vector<Point> points) {
    constexpr std::size_t kColumns = sizeof(Point) / sizeof(double);
    if (points.empty()) return empty<double>({0, kColumns}).array;
    auto kept = std::make_unique<std::vector<Point>>(std::move(points));
    const std::size_t count = kept->size();
    double* const data = &kept->front().x;
    const nb::capsule owner(kept.get(),
                            [](void* vector) noexcept { delete static_cast<std::vector<Point>*>(vector); });
    [[maybe_unused]] const auto* const owned = kept.release();
    return nb::cast(nb::ndarray<nb::numpy, double, nb::shape<-1, kColumns>, nb::c_contig>(
        data, {count, kColumns}, owner));
}

}  // namespace geomsrv::bind
