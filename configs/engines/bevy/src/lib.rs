//! Puts the lightmap of a glTF file with KILN_lightmap on the meshes of its scene.
//!
//! `app.add_plugins(KilnPlugin)`, then `commands.spawn(kiln_scene(&asset_server, "out/scene.glb"))`.
//! The bake needs `--config configs/engines/bevy.json`: one page, E/pi in KTX2.

use bevy::gltf::{Gltf, GltfLoaderSettings};
use bevy::pbr::{Lightmap, MeshMaterial3d, StandardMaterial};
use bevy::platform::collections::{HashMap, HashSet};
use bevy::prelude::*;

pub struct KilnPlugin;

impl Plugin for KilnPlugin {
    fn build(&self, app: &mut App) {
        app.add_systems(Update, (spawn_scenes, attach_lightmaps).chain());
    }
}

/// A baked scene, to be spawned below this entity.
#[derive(Component)]
#[require(Transform, Visibility)]
pub struct KilnScene {
    pub gltf: Handle<Gltf>,
    /// The folder of the file, in which its textures are.
    pub folder: String,
    /// `StandardMaterial::lightmap_exposure` of the lit materials: cd/m2 of the scene in a unit of the map.
    pub exposure: f32,
}

/// What KILN_lightmap says, once the file is there.
#[derive(Component)]
struct Pending {
    image: Handle<Image>,
    /// Names of lit nodes, as the loader gives them to entities.
    lit: HashSet<String>,
}

pub fn kiln_scene(assets: &AssetServer, path: &str) -> KilnScene {
    KilnScene {
        gltf: assets.load_with_settings(path.to_string(), |s: &mut GltfLoaderSettings| {
            s.include_source = true
        }),
        folder: path
            .rsplit_once('/')
            .map_or(String::new(), |(folder, _)| format!("{folder}/")),
        exposure: 1.0,
    }
}

/// The first texture that Bevy reads and that has E/pi itself: a KTX2 file whose first channel is the plane E.R.
fn texture_of(lightmap: &serde_json::Value) -> Result<String, String> {
    if lightmap["pages"].as_u64() != Some(1) {
        return Err("Bevy's Lightmap takes one page: bake with a larger --page-size".into());
    }
    let pi = std::f64::consts::PI;
    for encoding in lightmap["encodings"].as_array().into_iter().flatten() {
        for texture in encoding["textures"].as_array().into_iter().flatten() {
            let channel = &texture["channels"][0];
            let scale = channel["scale"].as_f64().unwrap_or(1.0);
            if texture["container"] == "ktx2"
                && channel["plane"] == "E.R"
                && (scale / pi - 1.0).abs() < 1e-3
            {
                return texture["uri"]
                    .as_str()
                    .map(String::from)
                    .ok_or("a texture has no uri".into());
            }
        }
    }
    Err("there is no texture of E/pi in KTX2: bake with --config configs/engines/bevy.json".into())
}

/// Names of nodes with KILN_lightmap; names that two nodes have are left out, and returned second.
fn lit_names(nodes: &[(String, bool)]) -> (HashSet<String>, Vec<String>) {
    let mut count: HashMap<&str, usize> = HashMap::default();
    for (name, _) in nodes {
        *count.entry(name).or_default() += 1;
    }
    let (single, double): (Vec<_>, Vec<_>) = nodes
        .iter()
        .filter(|(_, lit)| *lit)
        .map(|(name, _)| name.clone())
        .partition(|name| count[name.as_str()] == 1);
    (single.into_iter().collect(), double)
}

fn spawn_scenes(
    mut commands: Commands,
    scenes: Query<(Entity, &KilnScene), Without<SceneRoot>>,
    files: Res<Assets<Gltf>>,
    assets: Res<AssetServer>,
) {
    for (entity, scene) in &scenes {
        let Some(file) = files.get(&scene.gltf) else {
            continue;
        };
        let Some(root) = file
            .default_scene
            .clone()
            .or_else(|| file.scenes.first().cloned())
        else {
            continue;
        };
        commands.entity(entity).insert(SceneRoot(root));
        let Some(source) = &file.source else {
            error!("the file was loaded without include_source: use kiln_scene()");
            continue;
        };
        let texture = source
            .extension_value("KILN_lightmap")
            .ok_or("the file has no KILN_lightmap: load the scene.glb of a bake".to_string())
            .and_then(|extension| texture_of(&extension["lightmaps"][0]));
        match texture {
            Err(why) => error!("{why}"),
            Ok(uri) => {
                let nodes: Vec<_> = source
                    .nodes()
                    .map(|node| {
                        let name = node
                            .name()
                            .map_or(format!("GltfNode{}", node.index()), String::from);
                        (name, node.extension_value("KILN_lightmap").is_some())
                    })
                    .collect();
                let (lit, double) = lit_names(&nodes);
                for name in double {
                    warn!("several nodes are called {name}: they stay without lightmap");
                }
                commands.entity(entity).insert(Pending {
                    image: assets.load(format!("{}{uri}", scene.folder)),
                    lit,
                });
            }
        }
    }
}

fn attach_lightmaps(
    mut commands: Commands,
    scenes: Query<(Entity, &KilnScene, &Pending)>,
    children: Query<&Children>,
    names: Query<&Name>,
    meshes: Query<&MeshMaterial3d<StandardMaterial>, With<Mesh3d>>,
    mut materials: ResMut<Assets<StandardMaterial>>,
) {
    for (entity, scene, pending) in &scenes {
        let mut any = false;
        for node in children.iter_descendants(entity) {
            if !names
                .get(node)
                .is_ok_and(|name| pending.lit.contains(name.as_str()))
            {
                continue;
            }
            // Primitives are children of their node's entity.
            for primitive in children.get(node).into_iter().flatten() {
                let Ok(material) = meshes.get(*primitive) else {
                    continue;
                };
                any = true;
                commands.entity(*primitive).insert(Lightmap {
                    image: pending.image.clone(),
                    uv_rect: Rect::new(0.0, 0.0, 1.0, 1.0),
                    bicubic_sampling: false,
                });
                if let Some(material) = materials.get_mut(material) {
                    material.lightmap_exposure = scene.exposure;
                }
            }
        }
        if any {
            commands.entity(entity).remove::<Pending>();
        }
    }
}
