#pragma once

#include <string>

namespace kiln {

// One HTML page that loads nothing but this server's JSON. `nonce` allows its script and style.
std::string status_page(const std::string& nonce);
// For the header Content-Security-Policy.
std::string page_policy(const std::string& nonce);

}  // namespace kiln
