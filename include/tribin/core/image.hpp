#pragma once

#include <cstddef>
#include <vector>

namespace tribin {

/// A row-major grid of values; pixel (u, v) is column u of row v.
template <class T>
struct Image {
  int width = 0;
  int height = 0;
  std::vector<T> data;

  Image() = default;
  Image(int w, int h, T fill = T{}) : width(w), height(h), data(static_cast<std::size_t>(w) * h, fill) {}

  bool empty() const { return data.empty(); }
  std::size_t size() const { return data.size(); }
  std::size_t index(int u, int v) const { return static_cast<std::size_t>(v) * width + u; }
  bool contains(int u, int v) const { return u >= 0 && v >= 0 && u < width && v < height; }
  T& operator()(int u, int v) { return data[index(u, v)]; }
  const T& operator()(int u, int v) const { return data[index(u, v)]; }
  T* row(int v) { return data.data() + index(0, v); }
  const T* row(int v) const { return data.data() + index(0, v); }
};

}  // namespace tribin
