//! Soft shadows of the key light by shadow maps.
//!
//! A map stores the height of the nearest caster towards the light. Its filter is as wide as the penumbra (Fernando,
//! Percentage-Closer Soft Shadows, SIGGRAPH sketches 2005). The range of heights around each point shows for most
//! points that they are fully lit or fully dark, and these are not filtered at all.

use wide::{f32x4, i32x8};

use crate::camera::{
    math::{LANE_INDEX, LANES, V3, Vec3x8, f32x8, higher, lower, sum_lanes},
    raster::{HeightBuffer, ScreenCorners},
};
use softvt_geometry::basis_from_reference;
use softvt_scene::Lighting;

/// Edge of the part of the map in which points can be shaded, texels.
const INNER: usize = 512;
/// Border around it, texels, which the filter reads.
const MARGIN: usize = 16;
/// Edge of the whole map, texels.
const EDGE: usize = INNER + 2 * MARGIN;
/// Length of a row of the map in memory.
const STRIDE: usize = HeightBuffer::stride_of(EDGE);
/// Columns and rows of the map per column and row of its coarse copy.
const COARSE: usize = 2;
/// Edge of the coarse copy.
const COARSE_EDGE: usize = EDGE / COARSE;
/// Edge of the tiles that store ranges of heights, texels.
const TILE: usize = 1 << TILE_BITS;
const TILE_BITS: i32 = 2;
/// Tiles along an edge of the map.
const TILES: usize = EDGE / TILE;
/// Tiles on each side that a range includes: the reach of the widest filter.
const MARGIN_TILES: usize = 2;
/// Largest radius of filters for which the ranges with one tile on each side suffice, texels.
const NEAR_RADIUS: f32 = TILE as f32;
/// Depth bias, m: casters are drawn with coarser meshes than the receivers of their shadows.
const DEPTH_BIAS: f32 = 2e-3;
/// Maximum error of interpolated normals, rad. Heights above a surface that this error explains are the surface itself.
const MAX_NORMAL_ERROR: f32 = 0.1;
/// Minimum cosine between normals and the light; flatter incidence is clamped.
const MIN_COSINE: f32 = 0.02;
/// Maximum slope of a receiver plane; steeper ones say nothing about the height of occluders.
const MAX_RECEIVER_SLOPE: f32 = 1.5;
/// Maximum radius of the filter and of the search for occluders, texels.
const MAX_RADIUS: f32 = 7.4;
/// Maximum radius at which they read all texels; wider ones read the coarse copy, which moves borders of shadows by up
/// to a texel. Both read eight columns.
const MAX_FINE_RADIUS: f32 = (LANES / 2) as f32;
const _: () = assert!(MAX_RADIUS <= (COARSE * LANES / 2) as f32);
/// Minimum radius of the filter, texels.
const MIN_RADIUS: f32 = 1.5;
/// Maximum distance, texels, of points between which all are fully lit or fully dark if both ends are: filters around
/// both ends leave a gap of less than half a texel.
const MAX_UNIFORM_DISTANCE: f32 = 3.4;
/// Maximum distance, texels, of points between which visibility is interpolated if it is linear at their middle.
const MAX_LINEAR_DISTANCE: f32 = 2.5;
/// Maximum distance of points between which visibility is interpolated unseen, in radii of their filters. The curve of
/// a step is steepest at the border of the filter: an interpolation over half a radius is within 0.05 of it.
const MAX_SMOOTH_DISTANCE: f32 = 0.5;
/// Maximum difference of visibility from its interpolation.
const MAX_LINEAR_DEVIATION: f32 = 0.03;
/// Maximum distance of neighbouring points from the plane of one of them, m.
const MAX_PLANE_DISTANCE: f32 = 2e-3;
/// Minimum cosine between the normals of neighbouring points.
const MIN_NEIGHBOUR_COSINE: f32 = 0.97;
/// Minimum sine of the light's elevation; flatter light is clamped.
const MIN_ELEVATION_SINE: f32 = 0.15;
/// Height of empty texels, m.
const EMPTY: f32 = -1e9;

/// A value for each tile of a map, row by row.
type TilePlane = Box<[f32; TILES * TILES]>;

/// Heights above level ground in and around each tile of a map, m.
#[derive(Clone, Debug)]
struct TileRanges {
    min: TilePlane,
    max: TilePlane,
    /// The highest within [`NEAR_RADIUS`].
    near_max: TilePlane,
}

impl TileRanges {
    fn empty() -> Self {
        let plane = || Box::new([EMPTY; TILES * TILES]);
        Self { min: plane(), max: plane(), near_max: plane() }
    }

    fn clear(&mut self) {
        [&mut self.min, &mut self.max, &mut self.near_max].into_iter().for_each(|plane| plane.fill(EMPTY));
    }
}

/// Shadow map of a set of casters for a directional light.
#[derive(Clone, Debug)]
pub(crate) struct ShadowMap {
    /// Axes of the map's u and v, and the unit vector towards the light.
    axes: [V3; 3],
    centre: V3,
    texels_per_metre: f32,
    /// Tangent of the lamp's angular radius.
    tangent: f32,
    /// Rise of level ground per texel along u and v, m.
    ///
    /// Ranges compare heights above level ground: an occluder is further along the light than its receiver and thus
    /// also higher above level ground, whereas level ground never rises above itself.
    ground_slope: [f32; 2],
    texels: HeightBuffer,
    /// Every second row and column of the texels.
    coarse: Vec<f32>,
    ranges: TileRanges,
}

/// Eight points in the frame of a shadow map, which all maps of one [`Lighting`] and one radius share.
#[derive(Clone, Copy, Debug)]
pub(crate) struct LightSpacePoints {
    /// Column in the map, texels.
    pub(crate) u: f32x8,
    /// Row in the map, texels.
    pub(crate) v: f32x8,
    /// Height towards the light, m.
    pub(crate) height: f32x8,
    /// Height above level ground, m.
    pub(crate) height_above_ground: f32x8,
    /// Mask of the points that lie within the map.
    pub(super) is_inside: f32x8,
    /// The tile of each point, or one at the border of the map.
    tiles: [usize; LANES],
}

impl ShadowMap {
    /// An empty map that covers the ball in which a scene asks for fine shadows.
    pub(crate) fn new(lighting: &Lighting) -> Self {
        Self::with_radius(lighting, lighting.shadow_radius_m as f32)
    }

    /// An empty map that covers a concentric ball of `radius`, m.
    pub(crate) fn with_radius(lighting: &Lighting, radius: f32) -> Self {
        let to_light: V3 = lighting.key.direction_w.normalize().cast();
        let reference = if to_light.z.abs() < 0.99 { V3::z() } else { V3::x() };
        let [u, v] = basis_from_reference(&to_light, &reference);
        let axes = [u, v, to_light];
        let texels_per_metre = INNER as f32 / (2.0 * radius);
        let elevation = to_light.z.signum() * to_light.z.abs().max(MIN_ELEVATION_SINE) * texels_per_metre;
        Self {
            axes,
            ground_slope: [-axes[0].z / elevation, -axes[1].z / elevation],
            centre: lighting.shadow_centre_w.cast(),
            texels_per_metre,
            tangent: lighting.key.softness_rad.tan() as f32,
            texels: HeightBuffer::new(EDGE, EMPTY),
            coarse: vec![EMPTY; COARSE_EDGE * COARSE_EDGE],
            ranges: TileRanges::empty(),
        }
    }

    /// Redraws the map with these casters, each given by its vertices (world) and triangles.
    pub(crate) fn draw<'a>(&mut self, casters: impl Iterator<Item = (&'a [V3], &'a [[u32; 3]])>) {
        self.texels.clear(EMPTY);
        let mut vertices = Vec::new();
        for (positions, triangles) in casters {
            vertices.clear();
            vertices.extend(positions.iter().map(|p| self.project_vertex(p)));
            // u × v points to the light, so triangles that face it have positive area.
            let faces_light = |[a, b, c]: &ScreenCorners| {
                (b[0] - a[0]) * (c[1] - a[1]) - (c[0] - a[0]) * (b[1] - a[1]) > 0.0
            };
            let corners = triangles.iter().map(|t| t.map(|v| vertices[v as usize]));
            self.texels.draw(corners.filter(faces_light));
        }
        self.update_ranges();
        self.update_coarse();
    }

    fn update_coarse(&mut self) {
        self.coarse.fill(EMPTY);
        let ([from, to], [first, last]) = (self.texels.drawn_rows, self.texels.drawn_columns);
        let columns = first / COARSE..last.div_ceil(COARSE);
        for row in from.div_ceil(COARSE)..to.div_ceil(COARSE) {
            let texels =
                self.texels.heights[COARSE * (row * STRIDE + columns.start)..].iter().step_by(COARSE);
            let line = &mut self.coarse[row * COARSE_EDGE..][columns.clone()];
            line.iter_mut().zip(texels).for_each(|(coarse, texel)| *coarse = *texel);
        }
    }

    fn project_vertex(&self, p_w: &V3) -> [f32; 3] {
        let d = p_w - self.centre;
        let texel = |axis: usize| d.dot(&self.axes[axis]) * self.texels_per_metre + 0.5 * EDGE as f32;
        [texel(0), texel(1), d.dot(&self.axes[2])]
    }

    /// Projects points of the world.
    #[inline(always)]
    pub(crate) fn project(&self, p_w: Vec3x8) -> LightSpacePoints {
        let d = p_w - Vec3x8::splat(&self.centre);
        let [scale, middle] = [self.texels_per_metre, 0.5 * EDGE as f32].map(f32x8::splat);
        let u = d.dot(Vec3x8::splat(&self.axes[0])) * scale + middle;
        let v = d.dot(Vec3x8::splat(&self.axes[1])) * scale + middle;
        let height = d.dot(Vec3x8::splat(&self.axes[2]));
        let ground = u * f32x8::splat(self.ground_slope[0]) + v * f32x8::splat(self.ground_slope[1]);
        let (low, high) = (f32x8::splat(MARGIN as f32), f32x8::splat((MARGIN + INNER) as f32));
        let last = f32x8::splat((EDGE - 1) as f32);
        let tile = |x: f32x8| x.fast_max(f32x8::ZERO).fast_min(last).fast_trunc_int() >> TILE_BITS;
        let tiles = (tile(v) * i32x8::splat(TILES as i32) + tile(u)).to_array();
        LightSpacePoints {
            u,
            v,
            height,
            height_above_ground: height - ground,
            is_inside: u.simd_ge(low) & v.simd_ge(low) & u.simd_lt(high) & v.simd_lt(high),
            tiles: tiles.map(|i| (i as usize).min(TILES * TILES - 1)),
        }
    }

    /// Computes the ranges of heights.
    fn update_ranges(&mut self) {
        self.ranges.clear();
        let ([from, to], [first, last]) = (self.texels.drawn_rows, self.texels.drawn_columns);
        if from >= to {
            return;
        }
        let [mut lowest, mut highest] = [0, 1].map(|_| vec![EMPTY; TILES * TILES]);
        let stride = self.texels.stride();
        const TILES_PER_CHUNK: usize = LANES / TILE;
        for row in from / TILE..to.div_ceil(TILE) {
            for chunk in first / LANES..last.div_ceil(LANES) {
                let (mut low, mut high) = (f32x8::splat(f32::MAX), f32x8::splat(EMPTY));
                for y in row * TILE..(row + 1) * TILE {
                    let at = y * stride + chunk * LANES;
                    let Some(texels) = self.texels.heights[at..].first_chunk::<LANES>() else { continue };
                    let u = LANE_INDEX + f32x8::splat((chunk * LANES) as f32 + 0.5);
                    let ground = u * f32x8::splat(self.ground_slope[0])
                        + f32x8::splat(self.ground_slope[1] * (y as f32 + 0.5));
                    let above_ground = f32x8::new(*texels) - ground;
                    (low, high) = (low.fast_min(above_ground), high.fast_max(above_ground));
                }
                let (low, high) = (low.to_array(), high.to_array());
                for (tile, lanes) in (0..LANES).step_by(TILE).enumerate() {
                    let at = row * TILES + chunk * TILES_PER_CHUNK + tile;
                    lowest[at] = low[lanes..lanes + TILE].iter().copied().fold(f32::MAX, lower);
                    highest[at] = high[lanes..lanes + TILE].iter().copied().fold(EMPTY, higher);
                }
            }
        }
        let rows = (from / TILE).saturating_sub(MARGIN_TILES)..(to.div_ceil(TILE) + MARGIN_TILES).min(TILES);
        dilate::<MARGIN_TILES>(&lowest, rows.clone(), lower, &mut *self.ranges.min);
        dilate::<MARGIN_TILES>(&highest, rows.clone(), higher, &mut *self.ranges.max);
        dilate::<1>(&highest, rows, higher, &mut *self.ranges.near_max);
    }

    /// True if a shadow may fall within a box in the frame of the map: lowest and highest u, v (texels) and height
    /// above level ground (m).
    pub(crate) fn may_shade(&self, [low, high]: &[V3; 2]) -> bool {
        let tile = |x: f32| (x.max(0.0) as usize / TILE).min(TILES - 1);
        let columns = tile(low.x)..tile(high.x) + 1;
        (tile(low.y)..tile(high.y) + 1).any(|y| {
            let line = self.ranges.max[y * TILES..].get(columns.clone()).unwrap_or_default();
            line.iter().any(|max| *max > low.z + DEPTH_BIAS)
        })
    }

    /// Visible fraction of the light at points of normals `n`, given in the frame of this map; 1 where `mask` is clear
    /// or the map does not reach.
    #[inline(always)]
    pub(crate) fn visibility(&self, at: &LightSpacePoints, n: &Vec3x8, mask: f32x8) -> f32x8 {
        let inside = (at.is_inside & mask).to_bitmask();
        let [first, last] = self.texels.drawn_rows;
        if inside == 0 || first >= last {
            return f32x8::ONE;
        }
        let max = f32x8::new(at.tiles.map(|i| self.ranges.max[i]));
        let occluded = max.simd_gt(at.height_above_ground + f32x8::splat(DEPTH_BIAS)).to_bitmask() & inside;
        if occluded == 0 { f32x8::ONE } else { self.filtered_visibility(at, n, occluded) }
    }

    /// Visible fractions at the points of the bit mask `occluded`, which have something higher around their tiles.
    #[inline(never)]
    fn filtered_visibility(&self, at: &LightSpacePoints, n: &Vec3x8, occluded: u32) -> f32x8 {
        let receivers = Receivers::new(self, at, n);
        let distances = |i: usize| receivers.distances(at, n, i);
        let filter = |i: usize| receivers.light(i);
        let mut points = PointSequence { occluded, distances, filter, light: [FilteredLight::LIT; LANES] };
        points.evaluate(0);
        points.evaluate(LANES - 1);
        points.fill(0, LANES - 1);
        f32x8::new(points.light.map(|light| light.visible))
    }
}

/// The light that a filter lets pass.
#[derive(Clone, Copy, Debug, PartialEq)]
struct FilteredLight {
    /// Visible fraction of the light, 0 to 1.
    visible: f32,
    /// Radius of the filter, texels; infinite where nothing or everything occludes.
    radius: f32,
}

impl FilteredLight {
    const LIT: Self = Self { visible: 1.0, radius: f32::INFINITY };
    const DARK: Self = Self { visible: 0.0, radius: f32::INFINITY };
}

/// Eight points, of which neighbours often lie next to each other on one surface.
struct PointSequence<D, F> {
    /// Bit mask of the points that are filtered; the others are lit.
    occluded: u32,
    /// Distances from a point, texels; infinite for points that are not on one smooth surface with it.
    distances: D,
    /// The light at a point.
    filter: F,
    light: [FilteredLight; LANES],
}

impl<D: Fn(usize) -> f32x8, F: Fn(usize) -> FilteredLight> PointSequence<D, F> {
    fn evaluate(&mut self, i: usize) {
        if self.occluded >> i & 1 == 1 {
            self.light[i] = (self.filter)(i);
        }
    }

    /// Finds the light between two points at which it is known.
    fn fill(&mut self, first: usize, last: usize) {
        let between = (1 << last) - (2 << first);
        if between & self.occluded == 0 {
            return;
        }
        let (start, end) = (self.light[first], self.light[last]);
        let distances = (self.distances)(first);
        let is_within = |distance: f32| {
            let near = distances.simd_le(f32x8::splat(distance)).to_bitmask();
            (between | 1 << last) & !near == 0
        };
        let radius = start.radius.min(end.radius);
        let smooth_distance = match radius < f32::INFINITY {
            true => (radius * MAX_SMOOTH_DISTANCE).min(MAX_LINEAR_DISTANCE),
            false if start == end => MAX_UNIFORM_DISTANCE,
            false => 0.0,
        };
        if is_within(smooth_distance) {
            self.interpolate(first, last);
            return;
        }
        let middle = usize::midpoint(first, last);
        self.evaluate(middle);
        if last - first > 2 && is_within(MAX_LINEAR_DISTANCE) {
            let share = (middle - first) as f32 / (last - first) as f32;
            let expected = start.visible + (end.visible - start.visible) * share;
            if (self.light[middle].visible - expected).abs() < MAX_LINEAR_DEVIATION {
                self.interpolate(first, middle);
                self.interpolate(middle, last);
                return;
            }
        }
        self.fill(first, middle);
        self.fill(middle, last);
    }

    fn interpolate(&mut self, first: usize, last: usize) {
        let [start, end] = [first, last].map(|i| self.light[i].visible);
        for i in (first + 1..last).filter(|i| self.occluded >> i & 1 == 1) {
            self.light[i].visible = start + (end - start) * ((i - first) as f32 / (last - first) as f32);
        }
    }
}

/// Writes the extreme value of the tiles around each tile, up to `REACH` away, for some rows. `extreme` is the lower or
/// the higher of two.
fn dilate<const REACH: usize>(
    tiles: &[f32],
    rows: std::ops::Range<usize>,
    extreme: impl Fn(f32, f32) -> f32,
    dilated: &mut [f32],
) {
    for y in rows {
        // Along v, then along u, where the values at both ends are repeated.
        let mut columns = [tiles[y * TILES]; TILES + 2 * MARGIN_TILES];
        let own = REACH..REACH + TILES;
        columns[own.clone()].copy_from_slice(&tiles[y * TILES..(y + 1) * TILES]);
        for row in y.saturating_sub(REACH)..(y + REACH + 1).min(TILES) {
            let line = &tiles[row * TILES..(row + 1) * TILES];
            columns[own.clone()].iter_mut().zip(line).for_each(|(all, other)| *all = extreme(*all, *other));
        }
        let (first, last) = (columns[own.start], columns[own.end - 1]);
        columns[..own.start].fill(first);
        columns[own.end..].fill(last);
        let line = &mut dilated[y * TILES..(y + 1) * TILES];
        line.copy_from_slice(&columns[..TILES]);
        for shift in 1..=2 * REACH {
            let shifted = &columns[shift..shift + TILES];
            line.iter_mut().zip(shifted).for_each(|(all, other)| *all = extreme(*all, *other));
        }
    }
}

/// Percentage-closer filters around eight receivers.
///
/// Only occluders within the cone of the lamp count: an offset to the side larger than height × lamp width is
/// ignored, so a surface that rises next to the point does not darken it.
struct Receivers<'a> {
    map: &'a ShadowMap,
    tiles: &'a [usize; LANES],
    /// u and v, texels, and height, m.
    position: [[f32; LANES]; 3],
    /// Height above level ground, m.
    height_above_ground: [f32; LANES],
    normal: [[f32; LANES]; 3],
    /// Rise of the receiver's plane per texel along u and v, m.
    slope: [[f32; LANES]; 2],
    /// The slope clamped to [`MAX_RECEIVER_SLOPE`], from which heights of occluders are measured.
    clamped_slope: [[f32; LANES]; 2],
    /// Texels higher than this by more than the rise of the receiver's plane occlude, m; lower ones
    /// are the receiver itself.
    limit: [f32; LANES],
    /// Height above level ground, m, from which all texels around a receiver leave it dark.
    dark_height: [f32; LANES],
    /// Radius that the search for occluders on level ground would have before it is clamped, texels.
    ground_radius: [f32; LANES],
    /// Radius of the lamp's cone per metre of height, texels.
    cone: f32,
}

/// Occluders around a receiver.
struct Occluders {
    /// Sum of their weights; zero without any.
    weight: f32,
    /// Sum of weight × height above the receiver, m.
    weighted_height: f32,
    /// True if any texel of the search does not occlude.
    is_partial: bool,
}

impl<'a> Receivers<'a> {
    #[inline(always)]
    fn new(map: &'a ShadowMap, at: &'a LightSpacePoints, n: &Vec3x8) -> Self {
        let component = |axis: usize| n.dot(Vec3x8::splat(&map.axes[axis]));
        let inverse_cosine = f32x8::ONE / component(2).fast_max(f32x8::splat(MIN_COSINE));
        let texel = f32x8::splat(1.0 / map.texels_per_metre);
        let slope = [0, 1].map(|axis| -component(axis) * inverse_cosine * texel);
        let max_slope = f32x8::splat(MAX_RECEIVER_SLOPE) * texel;
        let clamped_slope = slope.map(|s| s.fast_max(-max_slope).fast_min(max_slope));
        let normal_bias =
            f32x8::splat(MIN_RADIUS * MAX_NORMAL_ERROR) * texel * inverse_cosine * inverse_cosine;
        let bias = f32x8::splat(DEPTH_BIAS) * inverse_cosine + normal_bias;
        let (own, reach) = (at.height_above_ground, f32x8::splat(MAX_RADIUS));
        let ground_slope = map.ground_slope.map(f32x8::splat);
        let steepest = slope[0].abs() + slope[1].abs() + (ground_slope[0].abs() + ground_slope[1].abs());
        let deviation =
            (ground_slope[0] - clamped_slope[0]).abs() + (ground_slope[1] - clamped_slope[1]).abs();
        let cone = map.tangent * map.texels_per_metre;
        let ground_radius = f32x8::splat(MIN_RADIUS) + (deviation * reach - own) * f32x8::splat(cone);
        Self {
            map,
            tiles: &at.tiles,
            position: [at.u, at.v, at.height].map(f32x8::to_array),
            height_above_ground: own.to_array(),
            normal: n.to_arrays(),
            slope: slope.map(f32x8::to_array),
            clamped_slope: clamped_slope.map(f32x8::to_array),
            limit: (at.height + bias).to_array(),
            dark_height: (own + bias + steepest * reach).to_array(),
            ground_radius: ground_radius.to_array(),
            cone,
        }
    }

    /// Distances of all points from point `i`, texels; infinite for those that are not on one smooth surface with it.
    fn distances(&self, at: &LightSpacePoints, n: &Vec3x8, i: usize) -> f32x8 {
        let [u, v, height] = self.position.each_ref().map(|lanes| f32x8::splat(lanes[i]));
        let (du, dv) = (at.u - u, at.v - v);
        let rise = du * f32x8::splat(self.slope[0][i]) + dv * f32x8::splat(self.slope[1][i]);
        let [x, y, z] = self.normal.each_ref().map(|lanes| f32x8::splat(lanes[i]));
        let is_smooth = (at.height - height - rise).abs().simd_lt(f32x8::splat(MAX_PLANE_DISTANCE))
            & n.dot(Vec3x8 { x, y, z }).simd_gt(f32x8::splat(MIN_NEIGHBOUR_COSINE));
        is_smooth.select(du.abs().fast_max(dv.abs()), f32x8::splat(f32::INFINITY))
    }

    /// The light that passes to receiver `i`.
    fn light(&self, i: usize) -> FilteredLight {
        let (ranges, tile) = (&self.map.ranges, self.tiles[i]);
        if ranges.min[tile] > self.dark_height[i] {
            return FilteredLight::DARK;
        }
        let radius_below =
            |height: f32| (self.ground_radius[i] + height * self.cone).clamp(MIN_RADIUS, MAX_RADIUS);
        let mut search_radius = radius_below(ranges.max[tile]);
        if search_radius <= NEAR_RADIUS {
            if ranges.near_max[tile] <= self.height_above_ground[i] + DEPTH_BIAS {
                return FilteredLight::LIT;
            }
            search_radius = radius_below(ranges.near_max[tile]);
        }
        let occluders = match search_radius {
            ..=MAX_FINE_RADIUS => self.occluders::<1>(i, search_radius),
            _ => self.occluders::<COARSE>(i, search_radius),
        };
        if occluders.weight <= 0.0 {
            return FilteredLight::LIT;
        }
        if !occluders.is_partial {
            return FilteredLight::DARK;
        }
        let mean_height = occluders.weighted_height / occluders.weight;
        let radius = (mean_height * self.cone).clamp(MIN_RADIUS, search_radius);
        let visible = match radius {
            ..=MAX_FINE_RADIUS => self.lit_share::<1>(i, radius),
            _ => self.lit_share::<COARSE>(i, radius),
        };
        FilteredLight { visible, radius }
    }

    /// Occluders in a square of half-width `radius`, texels, around receiver `i`, of which every `STEP`th row
    /// and column is read.
    ///
    /// They are weighed by the lamp's cone alone, so that the result does not depend on the radius.
    #[inline(always)]
    fn occluders<const STEP: usize>(&self, i: usize, radius: f32) -> Occluders {
        let window = FilterWindow::<STEP>::new(self, i, radius);
        // Most windows are clear: this finds those in fewer instructions.
        if window.is_clear() {
            return Occluders { weight: 0.0, weighted_height: 0.0, is_partial: true };
        }
        let in_range = window.du.abs().simd_lt(f32x8::splat(radius)).to_bitmask();
        let (mut weight, mut weighted_height) = (f32x8::ZERO, f32x8::ZERO);
        let mut is_partial = false;
        window.for_each_row(radius, |dv, heights| {
            let is_higher = window.is_higher(heights, dv);
            is_partial |= in_range & !is_higher.to_bitmask() != 0;
            let [rise, within] = window.occlusion(heights, dv, radius);
            let within = is_higher & within;
            weight += within;
            weighted_height += within * rise;
        });
        Occluders { weight: sum_lanes(weight), weighted_height: sum_lanes(weighted_height), is_partial }
    }

    /// Share of the light that passes to receiver `i`, by a filter of `radius` texels that reads every
    /// `STEP`th row and column.
    #[inline(always)]
    fn lit_share<const STEP: usize>(&self, i: usize, radius: f32) -> f32 {
        let window = FilterWindow::<STEP>::new(self, i, radius);
        let inverse2 = 1.0 / (radius * radius);
        // The product of two parabolas: smoother than a box, and separable.
        let weights = (f32x8::ONE - window.du * window.du * f32x8::splat(inverse2)).fast_max(f32x8::ZERO);
        let (mut lit, mut occluded) = (f32x8::ZERO, f32x8::ZERO);
        window.for_each_row(radius, |dv, heights| {
            let weight = weights * f32x8::splat(1.0 - dv * dv * inverse2);
            let is_higher = window.is_higher(heights, dv);
            if !is_higher.any() {
                lit += weight;
                return;
            }
            lit += weight & !is_higher;
            let [_, within] = window.occlusion(heights, dv, f32::MAX);
            occluded += weight * (is_higher & within);
        });
        let (lit, occluded) = (sum_lanes(lit), sum_lanes(occluded));
        if occluded <= 0.0 { 1.0 } else { lit / (lit + occluded) }
    }
}

/// The texels around a receiver: eight columns, of which every `STEP`th of the map is read, and up to eight such rows.
struct FilterWindow<'a, const STEP: usize> {
    /// Columns relative to the receiver, texels.
    du: f32x8,
    /// The first row relative to the receiver, texels.
    first_dv: f32,
    /// Heights from the first column and row on.
    heights: &'a [f32],
    /// Rise of the receiver's plane from the receiver to the columns, m.
    plane_rise: f32x8,
    /// Its rise per texel along v, m.
    slope_v: f32,
    /// Heights that exceed this by more than the rise of the plane occlude, m.
    limit: f32x8,
    /// Height of the clamped plane in the columns, m.
    clamped_height: f32x8,
    /// Its rise per texel along v, m.
    clamped_slope_v: f32,
    /// As in [`Receivers`].
    cone: f32,
}

impl<'a, const STEP: usize> FilterWindow<'a, STEP> {
    /// Length of a row of the texels in memory.
    const STRIDE: usize = if STEP == COARSE { COARSE_EDGE } else { STRIDE };

    #[inline(always)]
    fn new(receivers: &Receivers<'a>, i: usize, radius: f32) -> Self {
        let map = receivers.map;
        let [u, v, height] = receivers.position.each_ref().map(|lanes| lanes[i]);
        // The first texel read at most `radius` before the receiver. Vectors are converted without checks of the range.
        let before = f32x4::new([u, v, 0.0, 0.0]) - f32x4::splat(radius + 0.5);
        let first = (before * f32x4::splat(1.0 / STEP as f32) + f32x4::ONE).fast_trunc_int();
        let [first_u, first_v, ..] =
            (f32x4::from_i32x4(first) * f32x4::splat(STEP as f32) + f32x4::splat(0.5)).to_array();
        let [column, row, ..] = first.to_array();
        let texels = if STEP == COARSE { &map.coarse } else { &map.texels.heights };
        let du = LANE_INDEX * f32x8::splat(STEP as f32) + f32x8::splat(first_u - u);
        let [slope_u, slope_v] = receivers.slope.each_ref().map(|lanes| lanes[i]);
        let [clamped_slope_u, clamped_slope_v] = receivers.clamped_slope.each_ref().map(|lanes| lanes[i]);
        Self {
            du,
            first_dv: first_v - v,
            heights: texels.get(row as usize * Self::STRIDE + column as usize..).unwrap_or_default(),
            plane_rise: du * f32x8::splat(slope_u),
            slope_v,
            limit: f32x8::splat(receivers.limit[i]),
            clamped_height: du * f32x8::splat(clamped_slope_u) + f32x8::splat(height),
            clamped_slope_v,
            cone: receivers.cone,
        }
    }

    /// True if nothing in eight rows occludes. False at the end of the map, where there are fewer.
    #[inline(always)]
    fn is_clear(&self) -> bool {
        let Some(texels) = self.heights.get(..(LANES - 1) * Self::STRIDE + LANES) else { return false };
        let (mut dv, mut is_higher) = (self.first_dv, f32x8::ZERO);
        for row in 0..LANES {
            let Some(heights) = texels[row * Self::STRIDE..].first_chunk() else { return false };
            is_higher |= self.is_higher(f32x8::new(*heights), dv);
            dv += STEP as f32;
        }
        !is_higher.any()
    }

    /// Calls `add` with the distance from the receiver, texels, and the heights of every row within `radius`.
    #[inline(always)]
    fn for_each_row(&self, radius: f32, mut add: impl FnMut(f32, f32x8)) {
        let (mut left, mut dv) = (self.heights, self.first_dv);
        // A counter of rows and ranges of texels in place of iterators, which take as long as the sums.
        while dv < radius {
            let Some(texels) = left.first_chunk() else { break };
            add(dv, f32x8::new(*texels));
            dv += STEP as f32;
            left = left.get(Self::STRIDE..).unwrap_or_default();
        }
    }

    /// Mask of the heights in a row that occlude.
    #[inline(always)]
    fn is_higher(&self, heights: f32x8, dv: f32) -> f32x8 {
        let rise = self.plane_rise + f32x8::splat(self.slope_v * dv);
        heights.simd_gt(self.limit + rise.fast_max(f32x8::ZERO))
    }

    /// Heights above the receiver's clamped plane, and the share of each within the lamp's cone, of a radius of at most
    /// `max_reach` texels.
    #[inline(always)]
    fn occlusion(&self, heights: f32x8, dv: f32, max_reach: f32) -> [f32x8; 2] {
        let rise = heights - self.clamped_height - f32x8::splat(self.clamped_slope_v * dv);
        let reach =
            (rise * f32x8::splat(self.cone) + f32x8::splat(MIN_RADIUS)).fast_min(f32x8::splat(max_reach));
        // Full weight inside the cone, which fades out towards its border.
        let within = (reach * reach - self.du * self.du - f32x8::splat(dv * dv))
            * f32x8::splat(1.0 / (MIN_RADIUS * MIN_RADIUS));
        [rise, within.fast_max(f32x8::ZERO).fast_min(f32x8::ONE)]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Filters eight points of these visible fractions, `spacing` texels apart, by filters of this radius. Returns the
    /// result and the number of points that were filtered.
    fn fill(of: [f32; LANES], occluded: u32, spacing: f32, radius: f32) -> ([f32; LANES], usize) {
        let count = std::cell::Cell::new(0);
        let distances = |i: usize| (LANE_INDEX - f32x8::splat(i as f32)).abs() * f32x8::splat(spacing);
        let filter = |i: usize| {
            count.set(count.get() + 1);
            match of[i] {
                0.0 => FilteredLight::DARK,
                1.0 => FilteredLight::LIT,
                visible => FilteredLight { visible, radius },
            }
        };
        let mut points = PointSequence { occluded, distances, filter, light: [FilteredLight::LIT; LANES] };
        points.evaluate(0);
        points.evaluate(LANES - 1);
        points.fill(0, LANES - 1);
        (points.light.map(|light| light.visible), count.get())
    }

    /// A spacing at which no points are neighbours.
    const APART: f32 = 10.0;

    #[test]
    fn points_between_fully_lit_or_dark_neighbours_are_not_filtered() {
        let near = MAX_UNIFORM_DISTANCE / 7.01;
        assert_eq!(fill([0.0; LANES], 0xFF, near, 2.0), ([0.0; LANES], 2));
        assert_eq!(fill([1.0; LANES], 0xFF, near, 2.0), ([1.0; LANES], 2));
        assert_eq!(fill([0.0; LANES], 0xFF, 1.5 * near, 2.0), ([0.0; LANES], 3));
        let step = [0.0, 0.0, 0.0, 0.0, 0.4, 1.0, 1.0, 1.0];
        let (visible, count) = fill(step, 0xFF, near, 2.0);
        assert_eq!(visible, step);
        assert!(count < LANES, "{count}");
    }

    #[test]
    fn visibility_is_interpolated_where_it_is_linear_or_the_filter_wide() {
        let slope = std::array::from_fn(|i| 0.1 + 0.1 * i as f32);
        for (radius, points) in [(2.0, 3), (5.0, 2)] {
            let (visible, count) = fill(slope, 0xFF, MAX_LINEAR_DISTANCE / 7.01, radius);
            assert!(visible.iter().zip(slope).all(|(a, b)| (a - b).abs() < 1e-6), "{visible:?}");
            assert_eq!(count, points);
        }
        let bend = [0.0, 0.0, 0.0, 0.1, 0.3, 0.6, 0.8, 0.9];
        assert_eq!(fill(bend, 0xFF, MAX_LINEAR_DISTANCE / 7.01, 0.1).0, bend);
    }

    #[test]
    fn points_that_are_not_neighbours_are_all_filtered_and_points_without_occluders_are_lit() {
        let mixed = [0.0, 0.2, 0.9, 0.0, 1.0, 0.5, 0.3, 0.0];
        assert_eq!(fill(mixed, 0xFF, APART, MAX_RADIUS), (mixed, LANES));
        let all = |occluded: u32, spacing: f32| fill([0.0; LANES], occluded, spacing, MAX_RADIUS).0;
        assert_eq!(all(0b1010_0001, APART), [0.0, 1.0, 1.0, 1.0, 1.0, 0.0, 1.0, 0.0]);
        assert_eq!(all(0b1001_0001, 0.1), [0.0, 1.0, 1.0, 1.0, 0.0, 1.0, 1.0, 0.0]);
    }
}
