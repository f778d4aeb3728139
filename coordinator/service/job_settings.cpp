#include "coordinator/service/job_settings.h"

#include <algorithm>

#include "common/base/format.h"
#include "common/base/json.h"
#include "coordinator/farm/snapshot/option_files.h"

namespace kiln {
namespace {

using Kind = JsonValue::Kind;

// Settings that do not affect the result, or that name folders of another machine.
bool stays_behind(std::string_view name) {
  return name == "unwrap-cache" || name == "workers" || name == "threads" || name == "lease-ms";
}

Status set_from(BakeSettings& settings, const std::string& name, const JsonValue& value) {
  if (value.kind != Kind::kText)
    return fail(ErrorKind::kInvalidInput,
                text("setting '{}' must be a string or a list of strings", name.substr(0, 64)));
  if (const Status s = set_option(settings, name, value.text, "job"); !s)
    return fail(ErrorKind::kInvalidInput, s.error().message);
  return {};
}

}  // namespace

std::string write_job_settings(const BakeSettings& settings) {
  JsonWriter w;
  w.begin_object();
  for (const Setting& row : settings_table()) {
    if (!settings.source.count(row.name) || stays_behind(row.name)) continue;
    const std::string value = row.print(settings);
    w.key(row.name);
    if (std::string_view(row.name) != "sun") {
      w.value(value);
      continue;
    }
    w.begin_array();
    for (size_t at = 0; at < value.size();) {
      const size_t end = std::min(value.find(' ', at), value.size());
      w.value(value.substr(at, end - at));
      at = end + 1;
    }
    w.end_array();
  }
  return w.end_object().take();
}

Expected<BakeSettings> read_written_settings(const std::string& document) {
  BakeSettings settings;
  const auto root = parse_json(document);
  if (!root) return fail(ErrorKind::kInvalidInput, text("'settings': {}", root.error().message));
  if (root->kind != Kind::kObject) return fail(ErrorKind::kInvalidInput, "'settings' must be an object");
  for (const auto& [name, value] : root->members) {
    if (stays_behind(name))
      return fail(ErrorKind::kInvalidInput,
                  text("setting '{}' is the coordinator's own and not a job's", name));
    if (value.kind == Kind::kList) {
      for (const JsonValue& item : value.items) KILN_TRY_STATUS(set_from(settings, name, item));
    } else {
      KILN_TRY_STATUS(set_from(settings, name, value));
    }
  }
  if (const Status s = check_settings(settings); !s) return fail(ErrorKind::kInvalidInput, s.error().message);
  return settings;
}

Expected<BakeSettings> read_job_settings(const std::string& document, const std::vector<FileRecord>& inputs) {
  KILN_TRY(BakeSettings settings, read_written_settings(document));
  for (const FileOption& option : kFileOptions) {
    const std::string& value = settings.*option.value;
    if (!names_file(option, value)) continue;
    const bool known =
        value == path_of_option(option, value) &&
        std::any_of(inputs.begin(), inputs.end(), [&](const auto& f) { return f.path == value; });
    if (!known)
      return fail(ErrorKind::kInvalidInput, text("setting '{}' names {}, which is not among the job's files",
                                                 option.name, value.substr(0, 256)));
  }
  return settings;
}

}  // namespace kiln
