#pragma once

#include <iosfwd>
#include <string>
#include <vector>

namespace rio_t {

/// The program rio_t_bag: `words` are its arguments. Returns the exit status; what went wrong is told in
/// `err`.
int runBagTool(const std::vector<std::string>& words, std::ostream& out, std::ostream& err);

}  // namespace rio_t
