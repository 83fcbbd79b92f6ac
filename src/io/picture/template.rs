//! Names of many outputs: `thumbs/{name}-{clip}.webp`.

/// An output's name with fields for what is drawn.
///
/// `{name}` is the input's name without folder and ending, `{folder}` the name of its folder, `{clip}` that of the clip, `{index}` its number; `{{` and
/// `}}` stand for braces.
///
/// ```
/// use sinew::io::picture::{Fields, Template};
/// let template = Template::parse("thumbs/{name}-{clip}.####.png").unwrap();
/// let fields = Fields { name: "fox", folder: "in", clip: "Run / fast #2", index: 3 };
/// assert_eq!(template.fill(&fields), "thumbs/fox-Run _ fast _2.####.png");
/// assert!(Template::parse("{nmae}.png").is_err());
/// ```
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Template {
    parts: Vec<Part>,
}

#[derive(Clone, Debug, PartialEq, Eq)]
enum Part {
    Text(String),
    Name,
    Folder,
    Clip,
    Index,
}

/// What the fields stand for; characters that a file's name cannot have, or that mean a frame number, become `_`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Fields<'a> {
    /// `{name}`.
    pub name: &'a str,
    /// `{folder}`.
    pub folder: &'a str,
    /// `{clip}`.
    pub clip: &'a str,
    /// `{index}`: the clip's number in its file, from 0.
    pub index: usize,
}

/// Braces that mean nothing.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error(
    "\"{text}\": found \"{found}\"; expected {{name}}, {{folder}}, {{clip}} or {{index}}, and {{{{ or }}}} for a brace"
)]
pub struct TemplateError {
    /// The whole name.
    pub text: String,
    /// From the brace on.
    pub found: String,
}

impl Template {
    /// Find the fields of a name.
    ///
    /// # Errors
    /// [`TemplateError`] for an unknown field or a lone brace.
    pub fn parse(text: &str) -> Result<Self, TemplateError> {
        let mut parts = vec![];
        let mut rest = text;
        while !rest.is_empty() {
            let fields = [
                ("{name}", Part::Name),
                ("{folder}", Part::Folder),
                ("{clip}", Part::Clip),
                ("{index}", Part::Index),
            ];
            let braces = [("{{", Part::Text("{".into())), ("}}", Part::Text("}".into()))];
            let special = fields.into_iter().chain(braces).find(|(key, _)| rest.starts_with(key));
            if let Some((key, part)) = special {
                parts.push(part);
                rest = &rest[key.len()..];
            } else if rest.starts_with(['{', '}']) {
                return Err(TemplateError { text: text.to_owned(), found: rest.to_owned() });
            } else {
                let end = rest.find(['{', '}']).unwrap_or(rest.len());
                parts.push(Part::Text(rest[..end].to_owned()));
                rest = &rest[end..];
            }
        }
        Ok(Self { parts })
    }

    /// The name for one output.
    pub fn fill(&self, fields: &Fields) -> String {
        let part = |p: &Part| match p {
            Part::Text(text) => text.clone(),
            Part::Name => harmless(fields.name),
            Part::Folder => harmless(fields.folder),
            Part::Clip => harmless(fields.clip),
            Part::Index => fields.index.to_string(),
        };
        self.parts.iter().map(part).collect()
    }

    /// Whether inputs get different names.
    pub fn tells_inputs(&self) -> bool {
        self.parts.iter().any(|p| matches!(p, Part::Name | Part::Folder))
    }

    /// Whether the clips of an input get different names.
    pub fn tells_clips(&self) -> bool {
        self.parts.iter().any(|p| matches!(p, Part::Clip | Part::Index))
    }
}

/// A name that neither leads elsewhere nor means anything to a system or to a frame pattern.
fn harmless(name: &str) -> String {
    let bad = |c: char| c.is_control() || "/\\:*?\"<>|#%".contains(c);
    let text: String = name.chars().map(|c| if bad(c) { '_' } else { c }).collect();
    match text.trim_matches([' ', '.']) {
        "" => "_".into(),
        trimmed => trimmed.chars().take(100).collect(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_from_files_lead_nowhere_else() {
        let fill = |clip| {
            Template::parse("o/{clip}.png").unwrap().fill(&Fields { name: "", folder: "", clip, index: 0 })
        };
        assert_eq!(fill("../../etc/passwd"), "o/_.._etc_passwd.png");
        assert_eq!(fill(".."), "o/_.png");
        assert_eq!(fill("a%d#{clip}\n"), "o/a_d_{clip}_.png");
        assert_eq!(fill(&"x".repeat(5000)).len(), 100 + "o/.png".len());
    }

    #[test]
    fn braces_are_explained() {
        let says = |text: &str| Template::parse(text).unwrap_err().to_string();
        assert!(says("{clp}.png").contains("expected {name}, {folder}, {clip} or {index}, and {{ or }}"));
        assert!(says("a}.png").contains("\"}.png\""));
        assert_eq!(Template::parse("{{{name}}}").unwrap().parts.len(), 3);
    }
}
