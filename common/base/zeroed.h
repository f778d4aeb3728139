// Large arrays of zeros whose pages cost nothing until they are written.
#pragma once

#include <cstdlib>
#include <memory>
#include <new>
#include <type_traits>

namespace kiln {

// `size` values of 0. Sums of millions of texels take seconds to clear by hand on a machine that has to fetch
// the pages first; the system hands out zeroed ones as they are touched.
template <class T>
class Zeroed {
  static_assert(std::is_arithmetic_v<T>);

 public:
  Zeroed() = default;
  explicit Zeroed(size_t size)
      : size_(size), data_(static_cast<T*>(std::calloc(size ? size : 1, sizeof(T)))) {
    if (!data_) throw std::bad_alloc();
  }
  size_t size() const { return size_; }
  T& operator[](size_t i) { return data_.get()[i]; }
  const T& operator[](size_t i) const { return data_.get()[i]; }
  void clear() { *this = Zeroed(size_); }  // all 0 again

 private:
  struct Free {
    void operator()(T* p) const { std::free(p); }
  };
  size_t size_ = 0;
  std::unique_ptr<T, Free> data_;
};

}  // namespace kiln
