// What every fuzz target includes. A target takes any bytes, feeds them to one decoder, and holds what comes
// out to the decoder's promise with require(): a broken promise is a crash, which libFuzzer keeps.
#pragma once

#include <cstddef>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <span>
#include <string>

#include "common/base/bytes.h"

namespace kiln::fuzz {

inline void require(bool promise, const char* what) {
  if (promise) return;
  std::fprintf(stderr, "broken promise: %s\n", what);
  std::abort();
}

// An error is a sentence for a person, so it is never empty.
template <class T>
void require_sentence(const Expected<T>& result) {
  if (!result) require(!result.error().message.empty(), "an error says what is wrong");
}

inline std::string_view text_of(std::span<const std::byte> data) {
  return {reinterpret_cast<const char*>(data.data()), data.size()};
}

// The bytes as a file of this process, in memory where the machine has /dev/shm; overwritten by the next call
// with the same extension.
inline std::filesystem::path as_file(std::span<const std::byte> data, const char* extension) {
  struct Folder {
    std::filesystem::path path;
    Folder() {
      std::error_code code;
      const char* memory = "/dev/shm";
      std::string pattern =
          (std::filesystem::is_directory(memory, code) ? std::filesystem::path(memory)
                                                       : std::filesystem::temp_directory_path()) /
          "kiln-fuzz-XXXXXX";
      require(::mkdtemp(pattern.data()) != nullptr, "a folder for temporary files can be made");
      path = pattern;
    }
    ~Folder() {
      std::error_code ignored;
      std::filesystem::remove_all(path, ignored);
    }
  };
  static const Folder folder;
  const std::filesystem::path path = folder.path / (std::string("x") + extension);
  std::FILE* file = std::fopen(path.c_str(), "wb");
  require(file != nullptr, "a temporary file can be written");
  require(std::fwrite(data.data(), 1, data.size(), file) == data.size(), "a temporary file can be written");
  std::fclose(file);
  return path;
}

}  // namespace kiln::fuzz
