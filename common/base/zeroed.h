// Large arrays of zeros whose pages cost nothing until they are touched.
#pragma once

#include <cstdlib>
#include <new>
#include <type_traits>
#include <utility>
#include <vector>

namespace kiln {

// Memory that the system zeroes page by page on first touch, so the threads that fill it pay for it, if any
// does.
template <class T>
struct ZeroedAllocator {
  static_assert(std::is_trivial_v<T>);  // zero bytes must be a valid value
  using value_type = T;
  ZeroedAllocator() = default;
  template <class U>
  ZeroedAllocator(const ZeroedAllocator<U>&) {}
  T* allocate(size_t count) {
    if (void* p = std::calloc(count, sizeof(T))) return static_cast<T*>(p);
    throw std::bad_alloc();
  }
  void deallocate(T* p, size_t) { std::free(p); }
  template <class U, class... Values>
  void construct(U* p, Values&&... values) {
    if constexpr (sizeof...(Values) > 0) ::new (static_cast<void*>(p)) U(std::forward<Values>(values)...);
  }
  bool operator==(const ZeroedAllocator&) const { return true; }
};

// ZeroedVector<T>(n) holds `n` zeros. Growing one later may expose old contents, so construct it once, at its
// final size.
template <class T>
using ZeroedVector = std::vector<T, ZeroedAllocator<T>>;

}  // namespace kiln
