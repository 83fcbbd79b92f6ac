//! The notes' rigs against numbers computed in f64 by an independent program.

use glam::{DVec3, Vec3};
use sinew::character::{Binding, Character, Scratch};
use sinew::ik;
use sinew::io::{self, Import, Options, notes};
use sinew::skeleton::BoneId;
use sinew::skin::{Deformed, bind_closest};
use std::path::Path;

fn load(data: &Path, name: &str) -> Result<Import, String> {
    io::import(&data.join("notes/kinematics").join(name), &Options::default()).map_err(|e| e.to_string())
}

/// World positions of the one mesh.
fn vertices(c: &Character, clip: Option<usize>, t: f64) -> Vec<DVec3> {
    let pose = c.pose(clip, t);
    let posed = c.posed(&pose);
    let center = c.center(&posed);
    let mut out = Deformed::default();
    c.deform(0, &pose, &posed, center, &mut Scratch::default(), &mut out);
    out.positions.iter().map(|p| center + p.as_dvec3()).collect()
}

fn near(what: &str, got: DVec3, want: [f64; 3], bound: f64) -> Result<(), String> {
    let off = got.distance(DVec3::from_array(want));
    if off <= bound {
        Ok(())
    } else {
        Err(format!("{what}: {got} is {off:.2e} from {want:?}, bound {bound:.0e}"))
    }
}

/// Tip of bone 6 at two times and the mean vertex, to 1e-6.
pub fn the_robot_arm_is_where_it_should_be(data: &Path) -> Result<(), String> {
    let import = load(data, "robot-arm.json")?;
    let c = &import.asset.character;
    let tip = |t| {
        let posed = c.posed(&c.pose(Some(0), t));
        posed.world_from_bone(BoneId(6)).transform_point3(c.skeleton().tip(BoneId(6)).as_dvec3())
    };
    near("tip at 2.25 s", tip(2.25), [-0.311443419, 0.612340011, 0.146661247], 1e-6)?;
    near("tip at 3 s", tip(3.0), [0.029054939, 0.694882203, 0.168905313], 1e-6)?;

    // From rest the arm reaches for the same place.
    let (mut pose, target) = (c.rest_pose(), [-0.311443419, 0.612340011, 0.146661247]);
    let point = c.skeleton().tip(BoneId(6));
    let goal = ik::Goal { bone: BoneId(6), point, target: DVec3::from_array(target) };
    let bones = ik::chain(c.skeleton(), BoneId(6), 6);
    let found = ik::solve(c.skeleton(), &mut pose, &bones, &[goal], &ik::Settings::default());
    let reached = c.posed(&pose).world_from_bone(BoneId(6)).transform_point3(point.as_dvec3());
    near(&format!("tip pulled: {found:?}"), reached, target, 2e-6)?;
    let v = vertices(c, Some(0), 3.0);
    let mean = v.iter().sum::<DVec3>() / v.len() as f64;
    near("mean vertex at 3 s", mean, [0.017175659, 0.507363362, 0.106344036], 1e-6)
}

/// Closest segment, then area majority per component, gives the weights that come with the arm.
pub fn closest_segments_rebuild_the_arms_weights(data: &Path) -> Result<(), String> {
    let import = load(data, "robot-arm.json")?;
    let c = &import.asset.character;
    let Binding::Skin { palette, weights } = &c.instances()[0].binding else { return Err("no skin".into()) };
    let segments: Vec<_> = palette
        .iter()
        .map(|(bone, bone_from_mesh)| {
            let rest = bone_from_mesh.inverse();
            [Vec3::ZERO, c.skeleton().tip(*bone)].map(|p| rest.transform_point3(p))
        })
        .collect();
    let mesh = &c.meshes()[0];
    let bound = bind_closest(&mesh.positions, &mesh.triangles, &segments).map_err(|e| e.to_string())?;
    let differ = (0..mesh.positions.len()).filter(|&v| bound.of(v).next() != weights.of(v).next()).count();
    if differ > 0 { Err(format!("{differ} of {} vertices differ", mesh.positions.len())) } else { Ok(()) }
}

/// Skinning at rest gives the rest mesh, for every rig: 4ε of its size.
pub fn rest_is_the_identity(data: &Path) -> Result<(), String> {
    for name in ["robot-arm.json", "ikea-lamp.json", "chimpanzee-hand.json", "knight.json", "beast.json"] {
        let import = load(data, name)?;
        let c = &import.asset.character;
        let mesh = &c.meshes()[0];
        let size = mesh.positions.iter().map(|p| p.length()).fold(0.0, f32::max) as f64;
        let deformed = vertices(c, None, 0.0);
        let off = deformed.iter().zip(&mesh.positions).map(|(a, b)| a.distance(b.as_dvec3()));
        let worst = off.fold(0.0, f64::max);
        let bound = 4.0 * f32::EPSILON as f64 * size * (c.skeleton().len() as f64).sqrt();
        if worst > bound {
            return Err(format!("{name}: {worst:.2e} m off, bound {bound:.2e}"));
        }
    }
    Ok(())
}

/// What is closed is said to be closed.
pub fn surfaces_are_counted(data: &Path) -> Result<(), String> {
    for (name, closed) in [("robot-arm.json", true), ("knight.json", true), ("chimpanzee-hand.json", true)] {
        let import = load(data, name)?;
        let mesh = &import.asset.character.meshes()[0];
        let s = sinew::mesh::topology::surface(&mesh.positions, &mesh.triangles);
        if s.closed() != closed {
            return Err(format!("{name}: {s:?}"));
        }
        if name == "knight.json" && s.euler != 2 {
            return Err(format!("{name}: Euler characteristic {}", s.euler));
        }
    }
    let import = load(data, "ikea-lamp.json")?;
    let mesh = &import.asset.character.meshes()[0];
    let s = sinew::mesh::topology::HalfEdges::new(&mesh.triangles).summary(&mesh.triangles);
    if s.boundary_edges == 1352 {
        Ok(())
    } else {
        Err(format!("the lamp has {} boundary edges", s.boundary_edges))
    }
}

/// Cut files give errors, never panics.
pub fn cut_rigs_are_refused(data: &Path) -> Result<(), String> {
    let folder = data.join("notes/kinematics");
    let bytes = std::fs::read(folder.join("robot-arm.json")).map_err(|e| e.to_string())?;
    for n in 0..bytes.len() - 1 {
        if notes::import_bytes(&bytes[..n], &folder, &Options::default()).is_ok() {
            return Err(format!("the first {n} bytes were taken for a rig"));
        }
    }
    Ok(())
}
