//! What a look changes of the materials it finds.

use super::{AlphaMode, Material};
use glam::Vec3;

/// New coefficients for all materials of a name; what is `None` stays.
#[derive(Clone, Debug, PartialEq, Default)]
pub struct MaterialPatch {
    /// The name, in which `*` stands for anything and `?` for one character.
    pub name: String,
    /// `k_d`.
    pub diffuse: Option<Vec3>,
    /// Straight alpha; below 1 an opaque material begins to blend.
    pub alpha: Option<f32>,
    /// `k_s`.
    pub specular: Option<Vec3>,
    /// `p`.
    pub shininess: Option<f32>,
    /// Light of its own.
    pub emissive: Option<Vec3>,
    /// `L = k_d` alone.
    pub unlit: Option<bool>,
    /// Seen from behind too.
    pub double_sided: Option<bool>,
    /// `false` takes all textures away.
    pub textures: Option<bool>,
    /// `k_a`.
    pub ambient: Option<Vec3>,
    /// `k_m`.
    pub mirror: Option<Vec3>,
    /// Of glass.
    pub transmission: Option<Vec3>,
    /// Refractive index.
    pub ior: Option<f32>,
}

impl MaterialPatch {
    /// Whether a material's name is meant.
    ///
    /// ```
    /// let patch = sinew::scene::MaterialPatch { name: "skin*_?".into(), ..Default::default() };
    /// assert!(patch.matches("skin_1") && patch.matches("skin of the arm_2"));
    /// assert!(!patch.matches("skin") && !patch.matches("the skin_1"));
    /// ```
    pub fn matches(&self, name: &str) -> bool {
        let (pattern, name): (Vec<char>, Vec<char>) = (self.name.chars().collect(), name.chars().collect());
        let (mut p, mut n) = (0, 0);
        // After a star: where it stands, and how far it has reached. One star to go back to is enough.
        let mut star: Option<(usize, usize)> = None;
        while n < name.len() {
            match pattern.get(p) {
                Some('*') => {
                    star = Some((p, n));
                    p += 1;
                }
                Some(c) if *c == '?' || *c == name[n] => (p, n) = (p + 1, n + 1),
                _ => {
                    let Some((at, reach)) = star else { return false };
                    star = Some((at, reach + 1));
                    (p, n) = (at + 1, reach + 1);
                }
            }
        }
        pattern[p..].iter().all(|c| *c == '*')
    }

    /// Change a material, whatever its name.
    pub fn apply(&self, m: &mut Material) {
        if self.textures == Some(false) {
            (m.diffuse_map, m.specular_map, m.emissive_map) = (None, None, None);
            (m.normal_map, m.occlusion_map) = (None, None);
        }
        if let Some(c) = self.diffuse {
            m.diffuse = c.extend(m.diffuse.w);
        }
        if let Some(a) = self.alpha {
            m.diffuse.w = a;
            if a < 1.0 && m.alpha == AlphaMode::Opaque {
                m.alpha = AlphaMode::Blend;
            }
        }
        m.specular = self.specular.unwrap_or(m.specular);
        m.shininess = self.shininess.unwrap_or(m.shininess);
        m.emissive = self.emissive.unwrap_or(m.emissive);
        m.unlit = self.unlit.unwrap_or(m.unlit);
        m.double_sided = self.double_sided.unwrap_or(m.double_sided);
        m.ambient = self.ambient.or(m.ambient);
        m.mirror = self.mirror.unwrap_or(m.mirror);
        m.transmission = self.transmission.unwrap_or(m.transmission);
        m.ior = self.ior.unwrap_or(m.ior);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn stars_go_back_as_far_as_they_must() {
        let is = |p: &str, n: &str| MaterialPatch { name: p.into(), ..Default::default() }.matches(n);
        assert!(is("*", "") && is("*", "x") && is("a*b*c", "a-b-b-c") && is("é?", "éü"));
        assert!(!is("", "x") && !is("a*b", "abc") && !is("?", ""));
        // Quadratic at worst.
        assert!(!is(&"*a".repeat(40), &"a".repeat(39)));
    }

    #[test]
    fn what_is_not_named_stays() {
        let mut m = Material::default();
        MaterialPatch::default().apply(&mut m);
        assert_eq!(m, Material::default());
        MaterialPatch { alpha: Some(0.5), diffuse: Some(Vec3::X), ..Default::default() }.apply(&mut m);
        assert_eq!((m.diffuse, m.alpha), (Vec3::X.extend(0.5), AlphaMode::Blend));
    }
}
