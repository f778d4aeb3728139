#include "coordinator/bake/post/stage.h"

namespace kiln {

void complete_responses(Lightmap& map, const PostContext& context) {
  if (map.responses.data.empty()) return;
  Lightmap own;
  own.page_height = map.page_height;
  own.validity = map.response_validity;
  own.planes.width = map.planes.width;
  own.planes.height = map.planes.height;
  for (Planes* planes : {&map.responses, &map.response_error})
    for (std::vector<float>& plane : planes->data) own.planes.data.push_back(std::move(plane));
  own.planes.names.resize(own.planes.data.size());
  own.planes.add("samples");  // stages leave it alone
  fill_invalid(own, context);
  dilate(own, context);
  size_t next = 0;
  for (Planes* planes : {&map.responses, &map.response_error})
    for (std::vector<float>& plane : planes->data) plane = std::move(own.planes.data[next++]);
}

}  // namespace kiln
