#pragma once
// PLY files read by several threads before the parser asks for them.
//
// The parser works through a scene file in order and needs every mesh where it stands. What its text seems to
// name is guessed by a quick look (plymesh_files) and read meanwhile; take() gives each mesh, or the error of
// reading it, as if it had been read there and then. So a wrong guess costs time only, and what is reported
// does not depend on threads.
#include <condition_variable>
#include <deque>
#include <map>
#include <mutex>
#include <string>
#include <string_view>
#include <thread>
#include <vector>

#include "common/scene/description.h"

namespace lightmill {

/// File names that pbrt text seems to give to Shape "plymesh", in its order. A guess: comments count.
std::vector<std::string> plymesh_files(std::string_view pbrt_text);

/// A mesh from a file, without triangles that have no area and normals that have no direction.
struct CleanMesh {
  TriangleMesh mesh;
  size_t dropped_triangles = 0, mended_normals = 0;
};

class PlyReadAhead {
 public:
  /// Reads on up to `threads` threads (0: one per processor), of which that of take() is one.
  explicit PlyReadAhead(int threads);
  /// Waits for files in hand.
  ~PlyReadAhead();
  PlyReadAhead(const PlyReadAhead&) = delete;
  PlyReadAhead& operator=(const PlyReadAhead&) = delete;

  /// These paths will probably be taken, in this order, after those of earlier calls.
  void expect(const std::vector<std::string>& paths);
  /// The mesh of a file, expected or not. Throws what read_ply throws. Once per path.
  CleanMesh take(const std::string& path);

 private:
  struct File {
    enum class State { kWaiting, kReading, kDone } state = State::kWaiting;
    std::string path;
    size_t bytes = 0;  // once done: of the mesh
    CleanMesh mesh;
    std::exception_ptr failure;
  };
  File* next_to_read();
  void read(File* file, std::unique_lock<std::mutex>& lock);
  void work(const std::stop_token& stop);

  const int threads_;
  std::mutex mutex_;
  std::condition_variable_any changed_;  // a file was expected, is done, or was taken
  std::deque<File> files_;               // in the order expected
  std::map<std::string, File*> by_path_;
  size_t next_ = 0;        // files_ before it are not waiting
  size_t bytes_held_ = 0;  // of meshes that were read and not taken
  std::vector<std::jthread> pool_;
};

}  // namespace lightmill
