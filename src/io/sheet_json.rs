//! What is where on a sprite sheet, in the conventions that game engines read.
//!
//! | style | read by |
//! |---|---|
//! | [`Style::TexturePacker`] | Phaser (`load.atlas`), PixiJS, melonJS, importers of Godot and Unity |
//! | [`Style::TexturePackerArray`] | the same as a list, which keeps the order of the frames |
//! | [`Style::Aseprite`] | Phaser (`load.aseprite`), importers of Godot, Unity, Bevy and LÖVE |
//!
//! TexturePacker's styles name frames `clip/direction/number`, list them by clip and direction in `animations`, and give
//! the pivot twice, as `pivot` and as PixiJS's `anchor`. Aseprite's has frames with durations, named by their place in
//! the list as its own `{frame}` does, a tag for each clip and direction, and a slice called `pivot`. What the
//! conventions have no place for is in `meta.sinew`: frames a second, and [maps](crate::sheet::Map).

use crate::sheet::{Map, MapKind, Rect, Sheet, Sprite};
use serde::{Serialize, Serializer};
use serde_json::{Value, json};

/// A convention.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub enum Style {
    /// TexturePacker's JSON (Hash): an object of frames.
    #[default]
    TexturePacker,
    /// TexturePacker's JSON (Array): a list of frames.
    TexturePackerArray,
    /// Aseprite's list of frames with tags and slices.
    Aseprite,
}

/// The text of a sheet's JSON file. The same sheet gives the same text.
///
/// ```
/// use sinew::io::sheet_json::{Style, to_json};
/// use sinew::sheet::{Rect, Sheet, Sprite, Tag};
/// let place = Rect { x: 2, y: 0, w: 1, h: 4 };
/// let sprite = Sprite {
///     name: "walk/0001".into(), place, trim: Rect { x: 3, ..place }, source: [8, 4], pivot: [0.5, 1.0], duration_ms: 42,
/// };
/// let sheet = Sheet {
///     image: "sheet.png".into(), size: [3, 4], indexed: false, rate: "24".parse().unwrap(), sprites: vec![sprite],
///     tags: vec![Tag { name: "walk".into(), frames: 0..1 }], maps: vec![],
/// };
/// let text = to_json(&sheet, Style::TexturePacker);
/// assert!(text.contains(r#""walk/0001": {"#) && text.contains(r#""image": "sheet.png""#));
/// ```
pub fn to_json(sheet: &Sheet, style: Style) -> String {
    let text = match style {
        Style::TexturePacker => {
            let animations = Animations(sheet);
            pretty(&Hash { frames: Frames(&sheet.sprites), animations, meta: meta(sheet) })
        }
        Style::TexturePackerArray => {
            let named = |s: &Sprite| Frame { filename: Some(s.name.clone()), ..Frame::texture_packer(s) };
            pretty(&List { frames: sheet.sprites.iter().map(named).collect(), meta: meta(sheet) })
        }
        Style::Aseprite => {
            let frames = sheet.sprites.iter().enumerate().map(|(i, s)| Frame::aseprite(i, s));
            pretty(&List { frames: frames.collect(), meta: aseprite_meta(sheet) })
        }
    };
    text + "\n"
}

fn pretty(value: &impl Serialize) -> String {
    serde_json::to_string_pretty(value).expect("numbers, texts and maps with text keys have a JSON form")
}

#[derive(Serialize)]
struct Hash<'a> {
    frames: Frames<'a>,
    animations: Animations<'a>,
    meta: Value,
}

#[derive(Serialize)]
struct List {
    frames: Vec<Frame>,
    meta: Value,
}

/// An object in the order of the frames, which a sorted map would lose.
struct Frames<'a>(&'a [Sprite]);

impl Serialize for Frames<'_> {
    fn serialize<S: Serializer>(&self, s: S) -> Result<S::Ok, S::Error> {
        s.collect_map(self.0.iter().map(|sprite| (&sprite.name, Frame::texture_packer(sprite))))
    }
}

/// Names of frames by clip and direction: PixiJS makes animations of them.
struct Animations<'a>(&'a Sheet);

impl Serialize for Animations<'_> {
    fn serialize<S: Serializer>(&self, s: S) -> Result<S::Ok, S::Error> {
        let names = |frames: &std::ops::Range<usize>| -> Vec<&str> {
            self.0.sprites[frames.clone()].iter().map(|s| s.name.as_str()).collect()
        };
        s.collect_map(self.0.tags.iter().map(|t| (&t.name, names(&t.frames))))
    }
}

#[derive(Serialize)]
#[serde(rename_all = "camelCase")]
struct Frame {
    #[serde(skip_serializing_if = "Option::is_none")]
    filename: Option<String>,
    frame: Bounds,
    rotated: bool,
    trimmed: bool,
    sprite_source_size: Bounds,
    source_size: Size,
    #[serde(skip_serializing_if = "Option::is_none")]
    pivot: Option<Point>,
    #[serde(skip_serializing_if = "Option::is_none")]
    anchor: Option<Point>,
    #[serde(skip_serializing_if = "Option::is_none")]
    duration: Option<u32>,
}

impl Frame {
    fn new(s: &Sprite) -> Self {
        Self {
            filename: None,
            frame: s.place.into(),
            rotated: false,
            trimmed: s.trim != Rect::whole(s.source),
            sprite_source_size: s.trim.into(),
            source_size: Size { w: s.source[0], h: s.source[1] },
            pivot: None,
            anchor: None,
            duration: None,
        }
    }

    fn texture_packer(s: &Sprite) -> Self {
        let [x, y] = s.pivot.map(short);
        Self { pivot: Some(Point { x, y }), anchor: Some(Point { x, y }), ..Self::new(s) }
    }

    fn aseprite(index: usize, s: &Sprite) -> Self {
        // Phaser reads the pivot here, and passes slices over.
        let [x, y] = s.pivot.map(short);
        let filename = Some(index.to_string());
        Self { filename, duration: Some(s.duration_ms), pivot: Some(Point { x, y }), ..Self::new(s) }
    }
}

#[derive(Serialize)]
struct Bounds {
    x: usize,
    y: usize,
    w: usize,
    h: usize,
}

impl From<Rect> for Bounds {
    fn from(Rect { x, y, w, h }: Rect) -> Self {
        Self { x, y, w, h }
    }
}

#[derive(Serialize)]
struct Size {
    w: usize,
    h: usize,
}

#[derive(Serialize)]
struct Point {
    x: f64,
    y: f64,
}

/// Six digits behind the point: a hundredth of a pixel on the largest frame.
fn short(x: f64) -> f64 {
    (x * 1e6).round() / 1e6
}

/// What both conventions say of the whole sheet.
fn meta(sheet: &Sheet) -> Value {
    json!({
        "app": env!("CARGO_PKG_NAME"),
        "version": env!("CARGO_PKG_VERSION"),
        "image": sheet.image,
        "format": "RGBA8888",
        "size": { "w": sheet.size[0], "h": sheet.size[1] },
        "scale": "1",
        "sinew": {
            "frameRate": sheet.rate.fps(),
            "maps": sheet.maps.iter().map(map).collect::<serde_json::Map<_, _>>(),
        },
    })
}

/// The name of a map, and how to read it.
fn map(map: &Map) -> (String, Value) {
    let value = match &map.kind {
        MapKind::Normal => json!({
            "image": map.image,
            "axes": "+x right, +y up, +z towards the viewer",
            "decode": "n = 2 v / 255 - 1, normalised; linear, no sRGB",
        }),
        MapKind::Depth { near, far } => json!({
            "image": map.image,
            "near": near,
            "far": far,
            "unit": "m",
            "decode": "distance along the view = far - v / 65535 (far - near); 0 where nothing is",
        }),
        MapKind::Object { objects } => {
            let entry = |(i, (name, [r, g, b])): (usize, &(String, [u8; 3]))| json!({ "id": i + 1, "name": name, "color": format!("#{r:02x}{g:02x}{b:02x}") });
            let objects: Vec<Value> = objects.iter().enumerate().map(entry).collect();
            json!({ "image": map.image, "objects": objects, "decode": "palette index = id; 0 where nothing is" })
        }
    };
    (map.kind.name().to_owned(), value)
}

fn aseprite_meta(sheet: &Sheet) -> Value {
    let mut meta = meta(sheet);
    if sheet.indexed {
        meta["format"] = "I8".into();
    }
    let tag = |t: &crate::sheet::Tag| {
        let (from, to) = (t.frames.start, t.frames.end.saturating_sub(1));
        json!({ "name": t.name, "from": from, "to": to, "direction": "forward", "color": "#000000ff" })
    };
    meta["frameTags"] = sheet.tags.iter().map(tag).collect();
    let keys: Vec<Value> = pivot_keys(&sheet.sprites);
    meta["slices"] = json!([{ "name": "pivot", "color": "#0000ffff", "keys": keys }]);
    meta
}

/// A key wherever the pivot is not where it was in the frame before; whole pixels, as Aseprite has them.
fn pivot_keys(sprites: &[Sprite]) -> Vec<Value> {
    let pixel = |s: &Sprite| [0, 1].map(|i| (s.pivot[i] * s.source[i] as f64).round() as i64);
    let (mut keys, mut last) = (Vec::new(), None);
    for (i, s) in sprites.iter().enumerate() {
        let now = Some((pixel(s), s.source));
        if now != last {
            let ([x, y], [w, h]) = (pixel(s), s.source);
            keys.push(json!({ "frame": i, "bounds": { "x": 0, "y": 0, "w": w, "h": h }, "pivot": { "x": x, "y": y } }));
            last = now;
        }
    }
    keys
}
