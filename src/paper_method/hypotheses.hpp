#pragma once

#include <functional>
#include <optional>
#include <vector>

#include "tribin/paper_method/objects.hpp"
#include "tribin/part/part.hpp"
#include "tribin/recognition/instance.hpp"

namespace tribin::paper {

/// An observed primitive and the one of the CAD that it was matched with, and what was tested.
struct Match {
  const Primitive* seen = nullptr;
  const Primitive* model = nullptr;
  std::vector<TestResult> tests;
};

/// Two key cylinders matched, with the tests of the pair.
struct KeyPair {
  Match main, sub;
};

/// A key pair with its pose: by the base plane of case 4 and a second one at the right angle to it, or by two axes
/// alone.
struct PosedPair {
  const KeyPair* key = nullptr;
  std::vector<TestResult> tests;  ///< of the pair and its planes
  std::optional<Match> base;      ///< none: the place is still to be found, from the centroid of the seen points
  std::optional<Match> second;
  Matrix3 rotation = Matrix3::Identity();  ///< camera_from_part
  Vec3 translation = Vec3::Zero();
  double agreement = 0;  ///< sum of the area similarities: which are tried first
};

/// Remembers a test; false where it failed, which is then counted as a reason.
using Check = std::function<bool(const TestResult&)>;

/// M to N matching by r and h, cases 1 and 2, equation (7), cylinder distance.
std::vector<KeyPair> key_pairs(const Object& object, const Part& part, const Surfels& surfels, const Check& check);

/// Cases 3 and 4 and the indicators; each set that passes fixes a pose by section IV-C.
std::vector<PosedPair> posed_pairs(const KeyPair& key, const Object& object, const Surfels& surfels, const Part& part,
                                   const Check& check);

}  // namespace tribin::paper
