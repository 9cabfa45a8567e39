#pragma once

#include <filesystem>
#include <fstream>
#include <stdexcept>
#include <string>

namespace rio_t {

/// A device or a link is written in place: a rename would replace it.
inline bool isWrittenInPlace(const std::string& path) {
  std::error_code error;
  const std::filesystem::file_status status = std::filesystem::symlink_status(path, error);
  return std::filesystem::exists(status) && !std::filesystem::is_regular_file(status);
}

/// Writes the text to a temporary file and renames it, so that a full disk does not destroy the old file.
/// Throws std::runtime_error.
inline void replaceFile(const std::string& path, const std::string& text) {
  const bool in_place = isWrittenInPlace(path);
  const std::string written = in_place ? path : path + ".part";
  std::ofstream file(written, std::ios::binary | std::ios::trunc);
  file << text;
  file.close();
  std::error_code error;
  if (file && !in_place) std::filesystem::rename(written, path, error);
  if (file && !error) return;
  if (!in_place) std::filesystem::remove(written, error);
  throw std::runtime_error(path + ": cannot be written (disk full?)");
}

}  // namespace rio_t
