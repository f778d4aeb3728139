// Errors as values. Failures of the outside world are an Error; our own mistakes are a KILN_CHECK.
#pragma once

#include <string>
#include <tl/expected.hpp>
#include <utility>

namespace kiln {

// The kind decides the exit status and whether a retry can help.
enum class ErrorKind {
  kInvalidInput,  // a file or message is wrong: no retry, exit 2
  kUsage,         // the command line or job file is wrong: no retry, exit 2
  kIo,            // the operating system refused: exit 1
  kNoSpace,       // disk or memory is not enough: exit 1
  kProtocol,      // a peer broke the protocol: its connection is closed
  kUnavailable,   // a peer or resource is gone: a retry may help
  kInternal,      // a bug; the message holds what is needed to reproduce it
  kTooShort,      // a time limit leaves no time for a whole map: nothing is published, exit 4
};

// `message` is one sentence for a person: it names the thing, the place and the way out.
struct Error {
  ErrorKind kind;
  std::string message;
};

template <class T>
using Expected = tl::expected<T, Error>;
using Status = Expected<void>;

inline tl::unexpected<Error> fail(ErrorKind kind, std::string message) {
  return tl::unexpected<Error>(Error{kind, std::move(message)});
}

// Exit statuses: 0 done, 1 failed, 2 wrong usage or input, 3 published, but with texels that were never
// sampled (coordinator/cli/bake.cpp), 4 too little time for any map.
constexpr int kExitIncomplete = 3;
inline int exit_status(const Error& error) {
  if (error.kind == ErrorKind::kTooShort) return 4;
  return error.kind == ErrorKind::kInvalidInput || error.kind == ErrorKind::kUsage ? 2 : 1;
}

}  // namespace kiln

#define KILN_JOIN_(a, b) a##b
#define KILN_JOIN(a, b) KILN_JOIN_(a, b)

// KILN_TRY(auto x, f()): x becomes the value of f(), or the enclosing function returns its error.
#define KILN_TRY(declaration, expression)                                                    \
  auto&& KILN_JOIN(kiln_try_, __LINE__) = (expression);                                      \
  if (!KILN_JOIN(kiln_try_, __LINE__))                                                       \
    return tl::unexpected<::kiln::Error>(std::move(KILN_JOIN(kiln_try_, __LINE__)).error()); \
  declaration = std::move(*KILN_JOIN(kiln_try_, __LINE__))

// KILN_TRY_STATUS(f()): returns the error of f() if it failed.
#define KILN_TRY_STATUS(expression)                                                        \
  if (auto KILN_JOIN(kiln_try_, __LINE__) = (expression); !KILN_JOIN(kiln_try_, __LINE__)) \
  return tl::unexpected<::kiln::Error>(std::move(KILN_JOIN(kiln_try_, __LINE__)).error())
