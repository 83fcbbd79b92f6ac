//! Clips of other files: captures, and animations for another skeleton.

use crate::cli::{Failure, load, packed_clips, say::Say};
use serde::de::{self, MapAccess, Visitor};
use serde::{Deserialize, Deserializer};
use serde_json::{Value, json};
use sinew::bake::retarget::{self, Map};
use sinew::io::{self, Import, Options};
use sinew::skeleton::{BoneId, Skeleton};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

#[derive(clap::Args)]
pub(super) struct Motion {
    /// Take the clips from this file instead, a capture (.bvh), packed clips (.sinew) or whatever has clips, onto the input's bones: by --retarget, then by their
    /// names. May be given several times.
    #[arg(long, value_name = "FILE")]
    motion: Vec<PathBuf>,
    /// Which bone of the motion moves which of the input, as in {"bones": {"Hips": "pelvis", "Prop": null}, "scale": "auto",
    /// "directions": true}. `scale` is a number, or the ratio of the legs; with `directions` bones point where the motion's do, whatever
    /// the rest poses are (arms spread or hanging), without them they turn from rest as the motion's do.
    #[arg(long, value_name = "MAP.json", requires = "motion")]
    retarget: Option<PathBuf>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct File {
    #[serde(default, deserialize_with = "once")]
    bones: BTreeMap<String, Option<String>>,
    #[serde(default)]
    scale: Scale,
    directions: Option<bool>,
}

/// A map of which no name is there twice: one of its two would be lost.
fn once<'de, D: Deserializer<'de>>(from: D) -> Result<BTreeMap<String, Option<String>>, D::Error> {
    struct Once;
    impl<'de> Visitor<'de> for Once {
        type Value = BTreeMap<String, Option<String>>;

        fn expecting(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
            f.write_str("names of bones, or null, by names of bones")
        }

        fn visit_map<A: MapAccess<'de>>(self, mut entries: A) -> Result<Self::Value, A::Error> {
            let mut bones = BTreeMap::new();
            while let Some((from, to)) = entries.next_entry::<String, _>()? {
                if bones.insert(from.clone(), to).is_some() {
                    return Err(de::Error::custom(format!("bones: `{from}` is there twice")));
                }
            }
            Ok(bones)
        }
    }
    from.deserialize_map(Once)
}

#[derive(Deserialize)]
#[serde(untagged)]
enum Scale {
    Number(f64),
    Word(Auto),
}

#[derive(Deserialize)]
#[serde(rename_all = "lowercase")]
enum Auto {
    Auto,
}

impl Default for Scale {
    fn default() -> Self {
        Self::Word(Auto::Auto)
    }
}

impl Motion {
    /// Put the motions' clips in the place of the import's own; what was done, for the report.
    pub fn apply(&self, import: &mut Import, say: &Say) -> Result<Vec<Value>, Failure> {
        let mut told = vec![];
        let mut clips = vec![];
        let file = self.retarget.as_deref().map(read).transpose()?;
        for path in &self.motion {
            let bytes =
                io::read_file(path).map_err(|e| Failure::Input(format!("{}: {e}", path.display())))?;
            if let Some(packed) = packed_clips(path, &bytes, import, say)? {
                told.extend(
                    packed.iter().map(|c| json!({"file": path.display().to_string(), "clip": c.name})),
                );
                clips.extend(packed);
                continue;
            }
            let motion = load(path, Options::default(), say)?;
            let (source, target) = (&motion.asset.character, &import.asset.character);
            if source.clips().is_empty() {
                return Err(Failure::Input(format!("{}: there are no clips in it", path.display())));
            }
            let map = map(file.as_ref(), source.skeleton(), target.skeleton()).map_err(|e| {
                Failure::Usage(format!("{}: {e}", self.retarget.as_deref().unwrap_or(path).display()))
            })?;
            if map.pairs.is_empty() {
                let message = format!(
                    "{}: none of its bones is one of the input's; say which are with --retarget (`sinew info --json` lists them)",
                    path.display()
                );
                return Err(Failure::Usage(message));
            }
            for clip in source.clips() {
                let done = retarget::retarget(source, clip, target, &map);
                let names = |s: &Skeleton, ids: &[BoneId]| {
                    ids.iter().map(|b| s.name(*b).to_owned()).collect::<Vec<_>>()
                };
                let lost = names(source.skeleton(), &done.unmatched_source);
                let still = names(target.skeleton(), &done.unmatched_target);
                let warn = |place: &str, message: String| io::Warning { place: place.into(), message };
                let mut warnings = vec![];
                if !lost.is_empty() {
                    warnings.push(warn("bones of the motion that nothing follows", lost.join(", ")));
                }
                if !still.is_empty() {
                    warnings.push(warn("bones that keep their rest", still.join(", ")));
                }
                if done.left_out > 0 {
                    warnings.push(warn(
                        "tracks",
                        format!("{} of scales or morph weights left out", done.left_out),
                    ));
                }
                say.warnings(path, &warnings);
                told.push(json!({
                    "file": path.display().to_string(), "clip": clip.name, "scale": done.scale,
                    "pairs": map.pairs.len(), "unmatched_source": lost, "unmatched_target": still,
                }));
                clips.push(done.clip);
            }
        }
        if !self.motion.is_empty() {
            let character = std::mem::take(&mut import.asset.character);
            let with = character.with_clips(clips).map_err(|e| Failure::Run(e.to_string()))?;
            import.asset.character = with;
        }
        Ok(told)
    }

    /// Whether the clips are those of the input.
    pub fn is_empty(&self) -> bool {
        self.motion.is_empty()
    }
}

fn read(path: &Path) -> Result<File, Failure> {
    let bad = |e: &dyn std::fmt::Display| Failure::Input(format!("{}: {e}", path.display()));
    let bytes = io::read_file(path).map_err(|e| bad(&e))?;
    serde_json::from_slice(&bytes).map_err(|e| bad(&e))
}

fn map(file: Option<&File>, source: &Skeleton, target: &Skeleton) -> Result<Map, String> {
    let Some(file) = file else { return Ok(Map::by_names(source, target, &[])) };
    let mut given = vec![];
    let mut taken = BTreeMap::new();
    for (from, to) in &file.bones {
        let none = |name: &str, whose: &str| format!("bones: `{name}` is no bone of the {whose}");
        let from_id = source.find(from).ok_or_else(|| none(from, "motion"))?;
        let to_id = to.as_ref().map(|to| target.find(to).ok_or_else(|| none(to, "input"))).transpose()?;
        if let Some(other) = to_id.and_then(|id| taken.insert(id, from)) {
            return Err(format!(
                "bones: `{other}` and `{from}` both move `{}`",
                to.as_deref().unwrap_or_default()
            ));
        }
        given.push((from_id, to_id));
    }
    let scale = match file.scale {
        Scale::Number(n) if n.is_finite() && n > 0.0 => Some(n),
        Scale::Number(n) => return Err(format!("scale: expected a number above 0 or \"auto\", found {n}")),
        Scale::Word(Auto::Auto) => None,
    };
    Ok(Map { scale, directions: file.directions.unwrap_or(true), ..Map::by_names(source, target, &given) })
}
