//! Pictures of cards in one texture, and the cards that have them.

use image::{RgbaImage, imageops};

use super::{Card, corners};
use crate::scene::texture::MAX_SIDE;
use crate::tree::surface::Surface;

/// Empty texels around each picture, so that filters of two levels do not mix neighbours.
pub const GUTTER: u32 = 4;

/// One texture of many pictures.
pub struct Atlas {
    /// The texture.
    pub image: RgbaImage,
    /// Where each picture is: left, top, width and height, texels.
    places: Vec<[u32; 4]>,
}

/// Puts rectangles side by side in rows of a width, the highest first: the upper left corner of each, and the height of all.
pub fn shelves(sizes: &[[u32; 2]], width: u32) -> (Vec<[u32; 2]>, u32) {
    let mut order: Vec<usize> = (0..sizes.len()).collect();
    order.sort_by_key(|k| std::cmp::Reverse(sizes[*k][1]));
    let (mut places, mut x, mut y, mut row) = (vec![[0; 2]; sizes.len()], 0, 0, 0);
    for k in order {
        let [w, h] = sizes[k];
        if x + w > width {
            (x, y, row) = (0, y + row, 0);
        }
        places[k] = [x, y];
        (x, row) = (x + w, row.max(h));
    }
    (places, y + row)
}

/// The least width for rectangles to be about a square.
pub fn side(sizes: &[[u32; 2]]) -> u32 {
    let area: u64 = sizes.iter().map(|s| s.map(u64::from).iter().product::<u64>()).sum();
    let widest = sizes.iter().map(|s| s[0]).max().unwrap_or(0);
    ((area as f64).sqrt().ceil() as u32).max(widest)
}

impl Atlas {
    /// Of pictures with gutters around them; `None` where they do not fit.
    pub fn new(pictures: &[RgbaImage]) -> Option<Self> {
        let sizes: Vec<[u32; 2]> =
            pictures.iter().map(|p| [p.width() + 2 * GUTTER, p.height() + 2 * GUTTER]).collect();
        let width = side(&sizes).next_power_of_two();
        let (corners, height) = shelves(&sizes, width);
        if width > MAX_SIDE || height > MAX_SIDE {
            return None;
        }
        let mut image = RgbaImage::new(width, height);
        let place = |(picture, [x, y]): (&RgbaImage, [u32; 2])| {
            imageops::replace(&mut image, picture, (x + GUTTER).into(), (y + GUTTER).into());
            [x + GUTTER, y + GUTTER, picture.width(), picture.height()]
        };
        let places = pictures.iter().zip(corners).map(place).collect();
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
