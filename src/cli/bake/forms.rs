//! Other forms than curves in glTF: packed clips, stills, moving points; and fewer influences.

use super::clips::Edited;
use super::report::{self, Done};
use super::write::{self, put_bytes};
use super::{Args, failure, fresh, mesh, threads};
use crate::cli::{Failure, say, say::Say};
use serde_json::{Map, Value, json};
use sinew::asset::Asset;
use sinew::bake::{self, BakeDesc, Baked, vertices};
use sinew::character::Binding;
use sinew::clip::Clip;
use sinew::io::still::{self, Stance, Still};
use sinew::io::{self, Import, gltf, obj, pc2, ply, sinew_clip, stl};
use sinew::pose::Pose;
use sinew::time::{Range, frame_count};
use std::path::Path;

/// The most frames of a form without bones.
const MOST_FRAMES: usize = 100_000;

/// The most frames that are morph targets: their weights are a square of numbers.
const MOST_TARGETS: usize = 2000;

/// Options that are about curves.
const CURVES: [&str; 9] =
    ["tolerance", "metric", "pin", "fewest", "no_quantize", "keep_keys", "fps", "to", "additive"];

#[derive(clap::Args)]
pub(super) struct Forms {
    /// Write the character as it stands at this time: .glb, .gltf, .obj, .ply or .stl, in metres, closed where it was closed.
    #[arg(long, value_name = "SECONDS", allow_hyphen_values = true, value_parser = moment, conflicts_with = "vertices",
        conflicts_with_all = CURVES)]
    pose_at: Option<f64>,
    /// Write a clip for programs without skins, --vertices-fps frames a second: a morph target a frame (.glb, .gltf), or a point cache
    /// (.pc2) and the mesh that it moves (.obj).
    #[arg(long, conflicts_with_all = CURVES)]
    vertices: bool,
    /// Frames a second of --vertices.
    #[arg(long, value_name = "FPS", default_value_t = 30.0, value_parser = rate, requires = "vertices")]
    vertices_fps: f64,
    /// Keep this many influences a vertex, the largest, and say what that costs on these clips.
    #[arg(long, value_name = "K", value_parser = clap::value_parser!(u16).range(1..=64))]
    influences: Option<u16>,
    /// Pack all keys, vertices and indices by EXT_meshopt_compression, without loss.
    #[arg(long, conflicts_with_all = ["pose_at", "vertices"])]
    pub meshopt: bool,
    /// Store vertices in integers (KHR_mesh_quantization), as coarse as a third of the tolerance allows; the clips have what that leaves.
    #[arg(long, conflicts_with_all = ["pose_at", "vertices"])]
    pub quantize_mesh: bool,
}

fn moment(text: &str) -> Result<f64, String> {
    text.parse::<f64>().ok().filter(|t| t.is_finite()).ok_or_else(|| "expected a time in seconds".into())
}

fn rate(text: &str) -> Result<f64, String> {
    let fps = text.parse::<f64>().ok().filter(|f| (0.1..=1000.0).contains(f));
    fps.ok_or_else(|| "expected frames a second, 0.1 to 1000".into())
}

/// No tolerance: what is asked for is told, whatever it costs.
const UNBOUND: f64 = 1e12;

/// What the name of the output asks for.
fn ending(output: &Path) -> String {
    output.extension().unwrap_or_default().to_string_lossy().to_ascii_lowercase()
}

impl Forms {
    /// Endings of outputs.
    pub fn endings(&self) -> &'static [&'static str] {
        match (self.pose_at, self.vertices) {
            (Some(_), _) => &["glb", "gltf", "obj", "ply", "stl"],
            (None, true) => &["glb", "gltf", "pc2"],
            (None, false) => &["glb", "gltf", "json", "sinew"],
        }
    }

    /// Refuse what an output of this name has no place for.
    pub fn check(&self, args: &Args, name: &str) -> Result<(), Failure> {
        let (file, all) = match ending(Path::new(name)).as_str() {
            "json" => (".json rigs hold vertices and keys as text", false),
            "sinew" => (".sinew files hold packed clips alone, whose keys are chosen by their bits", true),
            _ => return Ok(()),
        };
        let given = [
            ("--quantize-mesh", self.quantize_mesh),
            ("--meshopt", self.meshopt),
            ("--influences", all && self.influences.is_some()),
            ("--no-quantize", all && args.no_quantize),
            ("--fewest", all && args.fewest.is_some()),
            ("--fps", all && args.edits.fps.is_some()),
            ("--keep-keys", all && args.edits.keep_keys),
        ];
        match given.iter().find(|g| g.1) {
            Some((option, _)) => {
                Err(Failure::Usage(format!("{option}: {file}; name a .glb or leave it out")))
            }
            None => Ok(()),
        }
    }

    /// Write what is no curves in glTF, and tell what was written; none if that is not what is wanted.
    pub fn write(
        &self,
        args: &Args,
        paths: [&Path; 2],
        import: &Import,
        edited: &[Edited],
        desc: &BakeDesc,
        say: &Say,
    ) -> Result<Option<Value>, Failure> {
        let clips: Vec<&Clip> = edited.iter().map(|e| &e.clip).collect();
        let solid = import.asset.character.meshes().iter().any(|m| !m.triangles.is_empty());
        if !solid && (self.pose_at.is_some() || self.vertices) {
            return Err(Failure::Input("there are no triangles that could be written".into()));
        }
        let mut told = if let Some(t) = self.pose_at {
            self.pose(args, paths, import, &clips, t, say)?
        } else if self.vertices {
            self.points(args, paths, import, &clips, say)?
        } else if ending(paths[1]) == "sinew" {
            packed(args, paths[1], import, edited, desc, say)?
        } else {
            return Ok(None);
        };
        (told["input"], told["output"]) = (json!(paths[0]), json!(paths[1]));
        if !args.json {
            say.note(&format!("wrote {}", paths[1].display()));
        }
        Ok(Some(told))
    }

    fn pose(
        &self,
        args: &Args,
        [input, output]: [&Path; 2],
        import: &Import,
        clips: &[&Clip],
        t: f64,
        say: &Say,
    ) -> Result<Value, Failure> {
        let c = &import.asset.character;
        let mut pose = c.rest_pose();
        if let Some(clip) = clips.first() {
            clip.sample(c.skeleton(), t, &mut pose);
            let range = clip.playback();
            if !(range.start..=range.end).contains(&t) {
                let (name, Range { start, end }) = (say::name(&clip.name), range);
                say.note(&format!("clip {name} runs from {start} to {end} s; this is its end"));
            }
        }
        let stance = Stance::new(c, &groups(import));
        let asset = &import.asset;
        let told = json!({"pose_at": t, "clip": clips.first().map(|c| &c.name)});
        match ending(output).as_str() {
            "obj" => with_materials(args, output, &stance.at(&pose), asset),
            "ply" => put_bytes(args, output, &ply::write(&stance.at(&pose))),
            "stl" => put_bytes(args, output, &stl::write(&stance.at(&pose))),
            _ => frozen(args, [input, output], import, &[pose], 1.0, "pose", &told),
        }?;
        Ok(told)
    }

    fn points(
        &self,
        args: &Args,
        [input, output]: [&Path; 2],
        import: &Import,
        clips: &[&Clip],
        say: &Say,
    ) -> Result<Value, Failure> {
        let [clip] = clips else {
            return Err(Failure::Usage("--vertices: expected one clip; choose it with --clip".into()));
        };
        let cache = ending(output) == "pc2";
        let range = clip.playback();
        let limit = if cache { MOST_FRAMES } else { MOST_TARGETS };
        let intervals = frame_count(range, self.vertices_fps, limit);
        let intervals = intervals.map_err(|e| Failure::Usage(format!("--vertices: {e}")))?;
        let c = &import.asset.character;
        let pose = |t: f64| {
            let mut pose = c.rest_pose();
            clip.sample(c.skeleton(), t.min(range.end), &mut pose);
            pose
        };
        let time = |k: f64| range.start + k / self.vertices_fps;
        let stance = Stance::new(c, &groups(import));
        let frames: Vec<f64> = (0..=intervals).map(|k| time(k as f64)).collect();
        let desc = BakeDesc { tolerance: UNBOUND, threads: threads(args), ..BakeDesc::default() };
        let cost = vertices::straight(c, clip, &frames, &desc);
        let told = json!({
            "fps": self.vertices_fps, "frames": intervals + 1, "between_frames": cost.ceiling,
            "measured": cost.worst.distance, "time": cost.worst.time, "moments": cost.moments,
        });
        if cache {
            let still = stance.at(&pose(time(0.0)));
            let mut bytes = pc2::head(still.points.len() as u32, intervals as u32 + 1);
            for k in 0..=intervals {
                let points: Vec<_> =
                    stance.points(&pose(time(k as f64))).iter().map(|p| p.as_vec3()).collect();
                bytes.extend(pc2::sample(&points));
            }
            with_materials(args, &output.with_extension("obj"), &still, &import.asset)?;
            put_bytes(args, output, &bytes)?;
        } else {
            let poses: Vec<Pose> = (0..=intervals).map(|k| pose(time(k as f64))).collect();
            frozen(args, [input, output], import, &poses, self.vertices_fps, &clip.name, &told)?;
        }
        say.note(&format!(
            "{} frames; exact at each, and at most {:.4} mm off between two, at {:.3} s",
            intervals + 1,
            1e3 * cost.ceiling,
            cost.worst.time
        ));
        Ok(told)
    }

    /// The import with fewer influences, and what that costs.
    pub fn limited(&self, import: &Import, edited: &[Edited], say: &Say) -> Option<(Import, Value)> {
        let k = self.influences?;
        let c = &import.asset.character;
        if !c.instances().iter().any(|i| matches!(i.binding, Binding::Skin { .. })) {
            say.note("--influences: nothing is skinned");
        }
        let less = c.with_influences(k.into());
        let (vertices, dropped) = vertices::dropped(c, &less);
        let (cost, _) =
            mesh::worst(c, &less, edited, &BakeDesc { tolerance: UNBOUND, ..BakeDesc::default() });
        say.note(&format!(
            "at most {k} influences: {vertices} vertices lose up to {:.1}% of their weight and stray by at most {:.4} mm",
            100.0 * dropped,
            1e3 * cost.ceiling,
        ));
        let told = json!({
            "kept": k, "vertices": vertices, "dropped": dropped, "bound": cost.ceiling,
            "measured": cost.worst.distance, "time": cost.worst.time, "moments": cost.moments,
        });
        let mut limited = import.clone();
        limited.asset.character = less;
        Some((limited, told))
    }

    /// Whether there is something to do without any clip.
    pub fn any(&self) -> bool {
        self.limits() || self.meshopt || self.quantize_mesh
    }

    /// Whether the file's own influences no longer serve.
    pub fn limits(&self) -> bool {
        self.influences.is_some()
    }
}

/// Instances of one node are one body.
fn groups(import: &Import) -> Vec<u32> {
    import.primitives.iter().map(|p| p.node).collect()
}

fn with_materials(args: &Args, path: &Path, still: &Still, asset: &Asset) -> Result<(), Failure> {
    let library = path.with_extension("mtl");
    let name = library.file_name().unwrap_or_default().to_string_lossy().into_owned();
    let (materials, shape) = (obj::materials(asset), obj::write(still, asset, Some(&name)));
    write::put_together(args, &[(library, materials.as_bytes()), (path.to_owned(), shape.as_bytes())])
}

/// A glTF file of poses, with the look of the input.
fn frozen(
    args: &Args,
    [input, output]: [&Path; 2],
    import: &Import,
    poses: &[Pose],
    fps: f64,
    name: &str,
    told: &Value,
) -> Result<(), Failure> {
    let bad = |e: &dyn std::fmt::Display| Failure::Input(format!("{}: {e}", input.display()));
    let character = still::frozen(&import.asset.character, poses, fps, name);
    let clips: Vec<gltf::NewClip> = character
        .clips()
        .iter()
        .map(|clip| gltf::NewClip { clip, short: &[], replaces: None, carried: None })
        .collect();
    let Asset { materials, textures, .. } = import.asset.clone();
    let asset = Asset { character: character.clone(), materials, textures, ..Asset::default() };
    let extras = Map::from_iter([("sinew".to_owned(), told.clone())]);
    // A glTF file's own look takes the place of this one.
    let own = import.format == "glTF";
    let pictures = if own { vec![] } else { fresh::pictures(&asset)? };
    let (mut out, _) = gltf::write(&asset, &pictures, &clips, extras).map_err(|e| bad(&e))?;
    if own {
        let bytes = io::read_file(input).map_err(|e| bad(&e))?;
        let folder = input.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
        gltf::wear(&mut out, &bytes, Some(folder)).map_err(|e| bad(&e))?;
        out.embed_pictures(Some(folder)).map_err(|e| bad(&e))?;
    }
    write::put(args, output, &out)
}

/// Packed clips in a file of their own.
fn packed(
    args: &Args,
    output: &Path,
    import: &Import,
    edited: &[Edited],
    desc: &BakeDesc,
    say: &Say,
) -> Result<Value, Failure> {
    let c = &import.asset.character;
    let (mut packed, mut done) = (vec![], vec![]);
    for e in edited {
        let one = bake::pack(c, &e.clip, desc).map_err(failure)?;
        done.push(Done {
            edited: e,
            baked: Baked { report: one.report, ..Baked::default() },
            allowed: desc.tolerance,
            mesh: 0.0,
        });
        packed.push((e.clip.name.as_str(), one.packed));
    }
    let all: Vec<_> = packed.iter().map(|(name, p)| (*name, p)).collect();
    put_bytes(args, output, &sinew_clip::write(c, &all))?;
    let diagonal = bake::Gauge::new(c, 1).diagonal();
    done.iter().filter(|_| !args.json).for_each(|d| say.note(&report::line(import, d, diagonal)));
    Ok(report::report(import, &done, args, desc, diagonal))
}
