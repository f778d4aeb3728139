// Whether a name can mean no other machine than this one. Decided by the text, never by asking a name server,
// whose answer may be another's.
#pragma once

#include <string_view>

namespace kiln {

// An address in 127.0.0.0/8, ::1, or exactly "localhost".
bool is_loopback(std::string_view host);
// The same for the host of a request, NAME or NAME:PORT, with an IPv6 address in brackets (RFC 9110, section
// 7.2). Anything else after the name is no.
bool is_loopback_authority(std::string_view authority);

}  // namespace kiln
