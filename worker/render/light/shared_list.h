#pragma once
// A list that its copies share. It holds the images of lights, which are large and the same in every table.
#include <memory>
#include <utility>
#include <vector>

namespace lightmill {

/// A change of one copy changes all. Fill a list before copying it.
template <class T>
class SharedList {
 public:
  bool empty() const { return list_->empty(); }
  size_t size() const { return list_->size(); }
  T& operator[](size_t i) { return (*list_)[i]; }
  const T& operator[](size_t i) const { return (*list_)[i]; }
  auto begin() { return list_->begin(); }
  auto end() { return list_->end(); }
  auto begin() const { return list_->cbegin(); }
  auto end() const { return list_->cend(); }
  template <class... Args>
  T& emplace_back(Args&&... args) {
    return list_->emplace_back(std::forward<Args>(args)...);
  }
  void pop_back() { list_->pop_back(); }

 private:
  std::shared_ptr<std::vector<T>> list_ = std::make_shared<std::vector<T>>();
};

}  // namespace lightmill
