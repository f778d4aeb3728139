# Shows out/scene.glb from its first camera and saves the picture.
extends Spatial

func _ready():
	var scene = load("res://out/scene.glb").instance()
	add_child(scene)
	var world = WorldEnvironment.new()
	world.environment = Environment.new()
	world.environment.background_mode = Environment.BG_COLOR
	world.environment.background_color = Color(0, 0, 0)
	world.environment.ambient_light_energy = 0
	add_child(world)
	var camera = find(scene, "Camera")
	camera.current = true
	print("users ", find(scene, "BakedLightmap").light_data.get_user_count())
	for _i in 5:
		yield(get_tree(), "idle_frame")
	yield(VisualServer, "frame_post_draw")
	var image = get_viewport().get_texture().get_data()
	image.flip_y()
	image.convert(Image.FORMAT_RGB8)
	image.save_png(OS.get_environment("KILN_SHOT"))
	get_tree().quit()

func find(node, kind):
	if node.is_class(kind):
		return node
	for child in node.get_children():
		var found = find(child, kind)
		if found:
			return found
	return null
