#include <dlfcn.h>

#include <algorithm>
#include <boost/algorithm/string/join.hpp>
#include <filesystem>
#include <stdexcept>

#include "rio_t/ros/parameters/parameters.h"

namespace rio_t {
namespace {

/// Returns the folder of the configurations that came with this library: PREFIX/lib/librio_t_ros.so and
/// PREFIX/share/rio_t/config, in the install space as in the devel space. No workspace needs to be sourced.
std::string configFolder() {
  static const char in_this_library = 0;
  Dl_info library;
  if (dladdr(&in_this_library, &library) == 0) return "";
  const auto path = std::filesystem::canonical(library.dli_fname);
  return (path.parent_path().parent_path() / "share/rio_t/config").string();
}

}  // namespace

std::string findConfigFile(const std::string& name_or_path) {
  namespace fs = std::filesystem;
  // A folder of that name does not count: `--config irs` works beside a folder with the results for irs.
  if (name_or_path.find('/') != std::string::npos || fs::is_regular_file(name_or_path)) {
    if (!fs::exists(name_or_path))
      throw std::runtime_error("configuration " + name_or_path + ": no such file");
    return name_or_path;
  }
  const std::string folder = configFolder();
  for (const char* extension : {"", ".yaml"}) {
    std::string path = folder + "/" + name_or_path + extension;
    if (fs::is_regular_file(path)) return path;
  }
  std::vector<std::string> names;
  if (fs::is_directory(folder)) {
    for (const auto& file : fs::directory_iterator(folder)) {
      if (file.path().extension() == ".yaml") names.push_back(file.path().stem().string());
    }
  }
  std::sort(names.begin(), names.end());
  throw std::runtime_error(
      "configuration " + name_or_path +
      ": no such file; configurations of the package: " + boost::algorithm::join(names, ", "));
}

}  // namespace rio_t
