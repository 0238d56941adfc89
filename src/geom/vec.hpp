// Copyright 2026 The geomsrv authors
// SPDX-License-Identifier: Apache-2.0
// Vectors, matrices and rigid transforms as plain values.  No algorithm lives here.
#pragma once

#include <cmath>

namespace geomsrv {

struct Vec2 {
    double x = 0.0;
    double y = 0.0;
};

struct Vec3 {
    double x = 0.0;
    double y = 0.0;
    double z = 0.0;
};

constexpr Vec2 operator+(Vec2 a, Vec2 b) { return {a.x + b.x, a.y + b.y}; }
constexpr Vec2 operator-(Vec2 a, Vec2 b) { return {a.x - b.x, a.y - b.y}; }
constexpr Vec2 operator-(Vec2 a) { return {-a.x, -a.y}; }
constexpr Vec2 operator*(double s, Vec2 a) { return {s * a.x, s * a.y}; }
constexpr double dot(Vec2 a, Vec2 b) { return a.x * b.x + a.y * b.y; }
/// z component of the cross product: > 0 where b lies counter-clockwise of a.
constexpr double cross(Vec2 a, Vec2 b) { return a.x * b.y - a.y * b.x; }
/// Outward normal of a counter-clockwise edge, not normalised (the book's Perp, section 7.7).
constexpr Vec2 outward(Vec2 edge) { return {edge.y, -edge.x}; }
inline double norm(Vec2 a) { return std::sqrt(dot(a, a)); }

constexpr Vec3 operator+(Vec3 a, Vec3 b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
constexpr Vec3 operator-(Vec3 a, Vec3 b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
constexpr Vec3 operator-(Vec3 a) { return {-a.x, -a.y, -a.z}; }
constexpr Vec3 operator*(double s, Vec3 a) { return {s * a.x, s * a.y, s * a.z}; }
constexpr double dot(Vec3 a, Vec3 b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
constexpr Vec3 cross(Vec3 a, Vec3 b) {
    return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
inline double norm(Vec3 a) { return std::sqrt(dot(a, a)); }
constexpr double component(Vec3 v, int k) { return k == 0 ? v.x : k == 1 ? v.y : v.z; }

/// Three rows; as a rotation it takes coordinates in b to coordinates in a.
struct Mat3 {
    Vec3 row[3] = {{1.0, 0.0, 0.0}, {0.0, 1.0, 0.0}, {0.0, 0.0, 1.0}};
};

constexpr Vec3 operator*(const Mat3& m, Vec3 v) {
    return {dot(m.row[0], v), dot(m.row[1], v), dot(m.row[2], v)};
}
/// Product with the transpose; the inverse where m is a rotation.
constexpr Vec3 transposed_times(const Mat3& m, Vec3 v) {
    return v.x * m.row[0] + v.y * m.row[1] + v.z * m.row[2];
}

/// X_ab: pose of b in a.  A point p_b given in b has coordinates rotation * p_b + translation in a.
struct Transform {
    Mat3 rotation;
    Vec3 translation;
};

constexpr Vec3 operator*(const Transform& X_ab, Vec3 p_b) { return X_ab.rotation * p_b + X_ab.translation; }

}  // namespace geomsrv
