# Godot 3.x: in a scene.glb that Kiln baked, choose this file as the import's Custom Script. The scene gets a BakedLightmap
# with the light that KILN_lightmap describes: E/pi of lightmap_E.exr, which the preset `godot` writes.
tool
extends EditorScenePostImport

const GAMMA = 1.0 / 2.2  # GLES2 computes with colours as they are coded

func post_import(scene):
	var file = get_source_file()
	var gltf = read_gltf(file)
	var lightmap = lightmap_of(gltf)
	if lightmap == null:
		push_error("%s: it has no KILN_lightmap: bake it with Kiln, then import its scene.glb" % file)
		return scene
	var textures = {}
	for texture in textures_of(lightmap):
		textures[int(texture.page)] = load_light(file.get_base_dir().plus_file(texture.uri), texture)
	if textures.empty() or textures.values().has(null):
		push_error("%s: the E/pi textures are not there: bake with --config configs/engines/godot.json" % file)
		return scene
	brighten(scene, gltf)
	attach(scene, gltf, textures)
	return scene

func read_gltf(path):
	var file = File.new()
	if file.open(path, File.READ) != OK:
		return {}
	if file.get_32() != 0x46546c67:
		file.seek(0)
		return parse(file.get_as_text())
	file.seek(12)
	var length = file.get_32()
	file.seek(20)
	return parse(file.get_buffer(length).get_string_from_utf8())

func parse(text):
	var result = JSON.parse(text)
	return result.result if result.error == OK and result.result is Dictionary else {}

func lightmap_of(gltf):
	var all = gltf.get("extensions", {}).get("KILN_lightmap", {}).get("lightmaps", [])
	return null if all.empty() else all[0]

# Float textures of E, one a page.
func textures_of(lightmap):
	for encoding in lightmap.encodings:
		if encoding.name != "exr":
			continue
		var out = []
		for texture in encoding.textures:
			if texture.channels[0].plane == "E.R":
				out.append(texture)
		if not out.empty():
			return out
	return []

# {texture, energy}: the shader shows base colour x texel x energy.
func load_light(path, description):
	var image = Image.new()
	if image.load(path) != OK:
		return null
	image.convert(Image.FORMAT_RGBF)
	var to_radiance = float(description.channels[0].get("scale", 1)) / PI
	if is_gles2():
		return coded(image, to_radiance)
	image.convert(Image.FORMAT_RGBH)
	return {"texture": texture_of(image), "energy": to_radiance}

# The project's driver: import again after it changed.
func is_gles2():
	return ProjectSettings.get_setting("rendering/quality/driver/driver_name") == "GLES2"

# Eight bits a channel of the root that colours are coded with. The brightest texel in a thousand is clipped, so that the
# others get finer steps.
func coded(image, to_radiance):
	var all = []
	image.lock()
	for y in image.get_height():
		for x in image.get_width():
			var c = image.get_pixel(x, y)
			var brightest = max(c.r, max(c.g, c.b))
			if brightest > 0:
				all.append(brightest)
	all.sort()
	var most = 1e-6 if all.empty() else all[int(0.999 * (all.size() - 1))]
	var out = Image.new()
	out.create(image.get_width(), image.get_height(), false, Image.FORMAT_RGB8)
	out.lock()
	for y in image.get_height():
		for x in image.get_width():
			var c = image.get_pixel(x, y)
			out.set_pixel(x, y, Color(pow(min(c.r / most, 1), GAMMA), pow(min(c.g / most, 1), GAMMA), pow(min(c.b / most, 1), GAMMA)))
	out.unlock()
	image.unlock()
	return {"texture": texture_of(out), "energy": pow(most * to_radiance, GAMMA)}

func texture_of(image):
	var texture = ImageTexture.new()
	texture.create_from_image(image, Texture.FLAG_FILTER)
	return texture

# The importer drops KHR_materials_emissive_strength.
func brighten(scene, gltf):
	var strengths = {}
	for material in gltf.get("materials", []):
		var strength = material.get("extensions", {}).get("KHR_materials_emissive_strength", {}).get("emissiveStrength", 1)
		strengths[material.get("name", "")] = float(strength)
	for instance in meshes_below(scene):
		for surface in instance.mesh.get_surface_count():
			var material = instance.mesh.surface_get_material(surface)
			if material is SpatialMaterial and strengths.get(material.resource_name, 1.0) != 1.0:
				var strength = strengths[material.resource_name]
				material.emission_energy = pow(strength, GAMMA) if is_gles2() else strength

func meshes_below(node):
	var out = [node] if node is MeshInstance else []
	for child in node.get_children():
		out += meshes_below(child)
	return out

# Calls attach_one for every lit node. Godot renames nodes, but keeps the tree: children stand in the file's order.
func attach(scene, gltf, textures):
	var node = BakedLightmap.new()
	node.name = "KilnLightmap"
	var data = BakedLightmapData.new()
	data.energy = textures.values()[0].energy
	var roots = gltf.scenes[int(gltf.get("scene", 0))].nodes
	var pairs = []
	pair(gltf, roots, scene, pairs)
	scene.add_child(node)
	node.owner = scene
	for pair in pairs:
		var lit = pair[0].get("extensions", {}).get("KILN_lightmap")
		if lit == null:
			continue
		if not pair[1] is MeshInstance:
			push_warning("%s is no mesh in Godot and stays dark" % pair[1].name)
			continue
		if lit.pages.size() != 1:
			push_warning("%s: its light is on several pages, of which Godot 3 takes one: a larger --page-size" % pair[1].name)
		data.add_user(node.get_path_to(pair[1]), textures[int(lit.pages[0])].texture, -1)
	if data.get_user_count() == 0:
		push_error("no object of the scene is one that KILN_lightmap names")
	node.light_data = data

func pair(gltf, indices, parent, out):
	if parent.get_child_count() < indices.size():
		push_error("%s: Godot has fewer nodes below it than the file" % parent.name)
		return
	for i in indices.size():
		var node = gltf.nodes[int(indices[i])]
		out.append([node, parent.get_child(i)])
		pair(gltf, node.get("children", []), parent.get_child(i), out)
