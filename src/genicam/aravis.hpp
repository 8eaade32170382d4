#pragma once

#include <arv.h>

#include <memory>
#include <string>
#include <utility>

#include "tribin/core/error.hpp"

// Aravis in C++: owned objects, and errors as tribin::Error.
namespace tribin::genicam {

struct Unref {
  void operator()(gpointer object) const { g_object_unref(object); }
};
template <class T>
using Owned = std::unique_ptr<T, Unref>;

/// Calls an Aravis function that ends in GError**. \throws Error device: "NAME: WHAT: Aravis' words".
template <class Function, class... Arguments>
auto call(const std::string& name, const std::string& what, Function function, Arguments&&... arguments) {
  GError* error = nullptr;
  const auto check = [&] {
    if (!error) return;
    const std::string words = error->message;
    g_clear_error(&error);
    throw Error(ErrorCode::device, name + ": " + what + ": " + words);
  };
  if constexpr (std::is_void_v<decltype(function(arguments..., &error))>) {
    function(std::forward<Arguments>(arguments)..., &error);
    check();
  } else {
    const auto result = function(std::forward<Arguments>(arguments)..., &error);
    check();
    return result;
  }
}

}  // namespace tribin::genicam
