#pragma once

#include <nlohmann/json.hpp>

#include "tribin/finder/finder.hpp"

namespace tribin::json {

using Json = nlohmann::ordered_json;

/// A number with so many decimals at most, never -0: what a reader can use, and no more.
Json rounded(double value, int decimals);
/// A number with six significant digits: for variances, which have no natural step.
Json significant(double value);
Json millimetres(double value);  ///< 10 nm steps
Json millimetres(const Vec3& value);
Json unit_vector(const Vec3& value);
Json degrees(double radians);
Json rotation(const Matrix3& rotation);
/// {"rotation", "translation_mm"}
Json pose(const Pose& pose);
Json matrix6(const Matrix6& matrix);

/// The covariance of a pose (order dt, w) in axes turned by R: both halves turn alike.
Matrix6 turned(const Matrix6& covariance, const Matrix3& rotation);
Vector6 turned(const Vector6& direction, const Matrix3& rotation);
/// A primitive as it is in another frame. Its covariance is about its own axis; planes keep their normal's sense.
Primitive moved(const Primitive& primitive, const Pose& b_from_a);

/// The head that all messages share: "tribin", "schema".
Json head();
/// {"file", "width", "height", "valid_points", "noise_mm"}; the median of the estimated noise where none was stated.
Json scan_summary(const Scan& scan, const Surfels* surfels);
/// The same of loose points: one row of them.
Json cloud_summary(const Surfels& surfels);
Json stages(const StageTimes& times);
Json warnings(const std::vector<Warning>& warnings, const std::vector<std::string>& more);
/// One primitive by interfaces.md section 4; `spaces` gives the peak that found it, or null.
Json primitive(const Primitive& primitive, const HoughSpaces* spaces);
Json relation(const Relation& relation, const Pose& b_from_a);
/// {"planes", "cylinders", "cones", "spheres"}: how many there are; "tori" where there are any.
Json counts(const std::vector<Primitive>& primitives);

/// The document as text: two spaces a level, but vectors and matrix rows on one line; ends with a newline.
std::string text_of(const Json& document);

/// A sentence with up to three numbers, by a printf format for doubles.
std::string with(const char* format, double a, double b = 0, double c = 0);

}  // namespace tribin::json
