// Tests that need node and packages of npm: they skip, saying what to install, where those are absent.
#pragma once

#include <optional>
#include <string>

namespace kiln::test {

// Whether the tests that use a group of programs (web, blender, godot) are to be left out: `./kiln test
// --without`, which hands it on in $KILN_TEST_WITHOUT. With the reason.
std::optional<std::string> left_out(const std::string& group);
// Why tests/node cannot run here (with what to do); nothing: it can. `browser`: Chromium is needed too, and
// three.js.
std::optional<std::string> no_node_tools(bool browser);
// The same of the engines of tests/node/engines.
std::optional<std::string> no_engines();
std::string node_script(const std::string& name);  // `node .../tests/node/NAME`, quoted for the shell

}  // namespace kiln::test
