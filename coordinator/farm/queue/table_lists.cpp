#include "coordinator/farm/queue/table_lists.h"

namespace kiln {

Bytes write_list(const std::vector<JobId>& ids) {
  ByteWriter w;
  w.put_array(ids);
  return w.take();
}

Bytes write_list(const std::vector<FileRecord>& files) {
  ByteWriter w;
  w.put<uint64_t>(files.size());
  for (const FileRecord& file : files) {
    w.put_string(file.path);
    w.put(file.digest);
    w.put(file.size);
  }
  return w.take();
}

Bytes write_list(const std::vector<std::string>& texts) {
  ByteWriter w;
  w.put<uint64_t>(texts.size());
  for (const std::string& text : texts) w.put_string(text);
  return w.take();
}

bool read_list(std::span<const std::byte> bytes, std::vector<JobId>& ids) {
  ByteReader r(bytes);
  ids = r.get_array<JobId>();
  return r.at_end();
}

bool read_list(std::span<const std::byte> bytes, std::vector<FileRecord>& files) {
  ByteReader r(bytes);
  files.resize(r.get_count(8 + 32 + 8));
  for (FileRecord& file : files) {
    file.path = r.get_string();
    file.digest = r.get<Digest>();
    file.size = r.get<uint64_t>();
  }
  return r.at_end();
}

bool read_list(std::span<const std::byte> bytes, std::vector<std::string>& texts) {
  ByteReader r(bytes);
  texts.resize(r.get_count(8));
  for (std::string& text : texts) text = r.get_string();
  return r.at_end();
}

}  // namespace kiln
