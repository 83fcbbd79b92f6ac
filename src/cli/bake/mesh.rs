//! Vertices in integers, as coarse as the tolerance leaves room for.

use super::clips::Edited;
use super::{Args, write};
use crate::cli::{Failure, say::Say};
use serde_json::{Value, json};
use sinew::bake::BakeDesc;
use sinew::bake::vertices::{self, Cost};
use sinew::character::{Binding, Character};
use sinew::clip::Clip;
use sinew::io::gltf::{self, MeshForm};
use sinew::io::{Import, Options, PrimitiveSource};
use std::collections::BTreeMap;
use std::path::Path;

/// What of the tolerance the vertices may take; the clips have what is left.
const PART: f64 = 1.0 / 3.0;

/// Groups of meshes that are made finer one by one; beyond, all are.
const TRIES: usize = 40;

/// Vertices that are to be written, and what they cost.
pub(super) struct Quantized {
    pub character: Character,
    /// By groups of meshes; those that are missing are the coarsest.
    pub forms: BTreeMap<usize, MeshForm>,
    /// Metres that no vertex exceeds in any clip.
    pub error: f64,
    pub told: Value,
}

/// The coarsest vertices that cost no more than a part of the tolerance in these clips, and at rest where there are none.
pub(super) fn quantized(
    args: &Args,
    input: &Path,
    import: &Import,
    edited: &[Edited],
    desc: &BakeDesc,
    say: &Say,
) -> Result<Quantized, Failure> {
    if import.format != "glTF" {
        let message = "--quantize-mesh: from glTF to glTF only; bake to a .glb first, then that one";
        return Err(Failure::Usage(message.into()));
    }
    let bad = |e: &dyn std::fmt::Display| Failure::Input(format!("{}: {e}", input.display()));
    let file = write::rewritten(args, input, import, &[], Default::default())?;
    if let Some(extension) = file.stranger() {
        return Err(write::stranger("--quantize-mesh", extension));
    }
    let asked = BakeDesc { tolerance: PART * desc.tolerance, ..desc.clone() };
    let mut forms = BTreeMap::new();
    for tries in 0..TRIES + 5 {
        let trial = tried(import, &file, &forms, edited, &asked).map_err(|e| bad(&e))?;
        if trial.cost.ceiling <= asked.tolerance {
            return Ok(trial.told(import, forms, asked.tolerance, say));
        }
        let group = |p: &PrimitiveSource| trial.groups[p.mesh as usize];
        let to_blame = trial.instance.filter(|_| tries < TRIES).map(|i| group(&import.primitives[i]));
        for g in trial.groups.iter().copied().filter(|g| to_blame.is_none_or(|b| b == *g)) {
            let mut of = import.primitives.iter().zip(import.asset.character.instances());
            let skinned = of.any(|(p, i)| group(p) == g && matches!(i.binding, Binding::Skin { .. }));
            let form: &mut MeshForm = forms.entry(g).or_default();
            *form = finer(*form, skinned).unwrap_or(*form);
        }
    }
    let input = input.display();
    Err(Failure::Differs(format!(
        "{input}: --quantize-mesh: its vertices cannot be stored within {:.3e} m; ask for more, or leave it out",
        asked.tolerance,
    )))
}

/// Vertices in some forms, and the clip in which they cost most.
struct Trial {
    out: gltf::Rewritten,
    groups: Vec<usize>,
    character: Character,
    cost: Cost,
    instance: Option<usize>,
}

fn tried(
    import: &Import,
    file: &gltf::Rewritten,
    forms: &BTreeMap<usize, MeshForm>,
    edited: &[Edited],
    desc: &BakeDesc,
) -> Result<Trial, String> {
    let mut out = file.clone();
    let groups = out.quantize(forms).map_err(|e| e.to_string())?;
    let other = gltf::import_bytes(&out.glb(), None, &Options { textures: false });
    let character = gltf::vertices_of(import, &other.map_err(|e| e.to_string())?)
        .ok_or("--quantize-mesh: its vertices cannot be compared with what becomes of them")?;
    let (cost, instance) = worst(&import.asset.character, &character, edited, desc);
    Ok(Trial { out, groups, character, cost, instance })
}

impl Trial {
    fn told(self, import: &Import, forms: BTreeMap<usize, MeshForm>, limit: f64, say: &Say) -> Quantized {
        let told = told(&self.out, import, &self.character, &self.cost, limit);
        let error = self.cost.ceiling;
        say.note(&format!(
            "vertices in integers: at most {:.4} mm off; {} of {} meshes have 16-bit positions, normals are up to {:.2}° off",
            1e3 * error,
            told["positions16"],
            told["meshes"],
            told["normals"].as_f64().unwrap_or(0.0),
        ));
        Quantized { character: self.character, forms, error, told }
    }
}

/// The next of the forms, coarsest first: 8 bits of weight cost most, then the rest about as much as each other.
fn finer(form: MeshForm, skinned: bool) -> Option<MeshForm> {
    match (form.positions, form.weights) {
        (true, _) if !skinned => Some(MeshForm { positions: false, weights: 8 }),
        (true, 8) => Some(MeshForm { positions: true, weights: 16 }),
        (true, 16) => Some(MeshForm { positions: true, weights: 32 }),
        (true, _) => Some(MeshForm { positions: false, weights: 16 }),
        (false, 16) => Some(MeshForm { positions: false, weights: 32 }),
        _ => None,
    }
}

/// The clip of highest cost, and the instance that is to blame.
pub(super) fn worst(
    c: &Character,
    changed: &Character,
    edited: &[Edited],
    desc: &BakeDesc,
) -> (Cost, Option<usize>) {
    let mut worst = (Cost::default(), None);
    let rest = Clip::default();
    let alone = [(&rest, None)];
    let clips: Vec<_> = edited.iter().map(|e| (&e.clip, e.over.clone())).collect();
    for (clip, over) in if clips.is_empty() { alone.to_vec() } else { clips } {
        let cost = vertices::changed(c, changed, clip, &BakeDesc { over, ..desc.clone() });
        if cost.ceiling > worst.0.ceiling {
            let instance = match cost.worst.spot {
                Some(sinew::bake::Spot::Vertex { instance, .. }) => Some(instance),
                _ => None,
            };
            worst = (cost, instance);
        }
        if cost.ceiling > desc.tolerance {
            break;
        }
    }
    worst
}

fn told(out: &gltf::Rewritten, import: &Import, changed: &Character, cost: &Cost, limit: f64) -> Value {
    let list = |key: &str| out.json.get(key).and_then(Value::as_array).map_or(&[][..], Vec::as_slice);
    let small = |mesh: &&Value| {
        let position = mesh["primitives"][0]["attributes"]["POSITION"].as_u64();
        position.is_some_and(|a| list("accessors")[a as usize]["componentType"] == 5122)
    };
    json!({
        "meshes": list("meshes").len(), "positions16": list("meshes").iter().filter(small).count(),
        "error": cost.ceiling, "measured": cost.worst.distance, "time": cost.worst.time, "moments": cost.moments,
        "limit": limit, "normals": turned(&import.asset.character, changed),
    })
}

/// The largest angle between a normal and what became of it, degrees.
fn turned(from: &Character, to: &Character) -> f64 {
    let meshes = from.instances().iter().zip(to.instances()).map(|(a, b)| (from.mesh(a), to.mesh(b)));
    let normals = meshes.flat_map(|(a, b)| a.normals.iter().zip(&b.normals));
    let angles = normals.map(|(a, b)| a.as_dvec3().angle_between(b.as_dvec3()).to_degrees());
    angles.fold(0.0, f64::max)
}
