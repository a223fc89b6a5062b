//! Pictures of cards in one texture, and the cards that have them.

use image::{RgbaImage, imageops};

use super::{Card, corners};
use crate::scene::texture::MAX_SIDE;
use crate::tree::surface::Surface;

/// Empty texels around each picture, so that filters of two levels do not mix neighbours.
const GUTTER: u32 = 4;

/// One texture of many pictures.
pub struct Atlas {
    /// The texture.
    pub image: RgbaImage,
    /// Where each picture is: left, top, width and height, texels.
    places: Vec<[u32; 4]>,
}

impl Atlas {
    /// Puts pictures side by side in rows, the highest first; `None` where they do not fit.
    pub fn new(pictures: &[RgbaImage]) -> Option<Self> {
        let padded = |p: &RgbaImage| [p.width() + 2 * GUTTER, p.height() + 2 * GUTTER];
        let area: u64 = pictures.iter().map(|p| padded(p).map(u64::from).iter().product::<u64>()).sum();
        let widest = pictures.iter().map(|p| padded(p)[0]).max()?;
        let width = ((area as f64).sqrt().ceil() as u32).max(widest).next_power_of_two();
        let mut order: Vec<usize> = (0..pictures.len()).collect();
        order.sort_by_key(|k| std::cmp::Reverse(pictures[*k].height()));
        let (mut places, mut x, mut y, mut row) = (vec![[0; 4]; pictures.len()], 0, 0, 0);
        for k in order {
            let [w, h] = padded(&pictures[k]);
            if x + w > width {
                (x, y, row) = (0, y + row, 0);
            }
            places[k] = [x + GUTTER, y + GUTTER, pictures[k].width(), pictures[k].height()];
            (x, row) = (x + w, row.max(h));
        }
        let height = y + row;
        if width > MAX_SIDE || height > MAX_SIDE {
            return None;
        }
        let mut image = RgbaImage::new(width, height);
        for (picture, place) in pictures.iter().zip(&places) {
            imageops::replace(&mut image, picture, place[0].into(), place[1].into());
        }
        Some(Atlas { image, places })
    }

    /// Two triangles a card.
    pub fn surface(&self, cards: &[Card]) -> Surface {
        let mut surface = Surface::default();
        let size = [self.image.width(), self.image.height()].map(|n| n as f32);
        for (card, place) in cards.iter().zip(&self.places) {
            let normal = card.right.cross(card.up).normalize_or(glam::Vec3::Z).to_array();
            let first = surface.positions.len() as u32;
            for (at, uv) in corners(card) {
                surface.positions.push(at.to_array());
                surface.normals.push(normal);
                let [x, y, w, h] = place.map(|v| v as f32);
                surface.uvs.push([(x + w * uv.x) / size[0], (y + h * uv.y) / size[1]]);
            }
            surface.indices.extend([0, 3, 2, 0, 2, 1].map(|i| first + i));
        }
        surface
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pictures_keep_their_texels_and_none_touch() {
        let pictures: Vec<RgbaImage> = (1..40u32)
            .map(|k| RgbaImage::from_pixel(3 + k * 7 % 23, 2 + k * 5 % 31, image::Rgba([k as u8, 0, 0, 255])))
            .collect();
        let atlas = Atlas::new(&pictures).unwrap();
        for (k, [x, y, w, h]) in atlas.places.iter().copied().enumerate() {
            let (right, below) = (x + w + GUTTER, y + h + GUTTER);
            for v in y - GUTTER..below.min(atlas.image.height()) {
                for u in x - GUTTER..right.min(atlas.image.width()) {
                    let inside = (x..x + w).contains(&u) && (y..y + h).contains(&v);
                    let want = if inside { [k as u8 + 1, 0, 0, 255] } else { [0; 4] };
                    assert_eq!(atlas.image.get_pixel(u, v).0, want, "{k}: {u}, {v}");
                }
            }
        }
    }
}
