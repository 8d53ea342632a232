//! The moving objects in the state of the last image. The images of all cameras in that state share their meshes and
//! shadows.

use std::sync::Arc;

use super::pass::PosedObject;
use crate::camera::{
    error::CameraError,
    mesh::lod::Lod,
    scene::{FrameView, PosedMesh, RenderObject, RenderScene},
    shade::shadow::ShadowMap,
};
use softvt_geometry::{Pose, Vec3};

/// The moving objects of a scene in one state.
#[derive(Debug)]
pub(crate) struct MovingObjects {
    nodes: Vec<Vec<Vec3>>,
    rigid: Vec<Pose>,
    links: Vec<Vec<Pose>>,
    node_colours: Vec<Vec<[f32; 3]>>,
    /// The posed meshes, by object and level of detail.
    meshes: Vec<Vec<Option<Arc<PosedMesh>>>>,
    shadow: ShadowMap,
    /// Segmentation id that the shadows leave out; `None` if they are not drawn yet.
    shadow_hidden_id: Option<u16>,
}

impl MovingObjects {
    pub(crate) fn new(scene: &RenderScene) -> Self {
        Self {
            nodes: Vec::new(),
            rigid: Vec::new(),
            links: Vec::new(),
            node_colours: Vec::new(),
            meshes: scene.objects.iter().map(|object| vec![None; object.mesh.level_count()]).collect(),
            shadow: ShadowMap::new(&scene.lighting),
            shadow_hidden_id: None,
        }
    }

    /// Adopts a state: what was made of another one is dropped.
    pub(crate) fn adopt(&mut self, view: &FrameView) {
        let is_same = self.nodes == view.nodes
            && self.rigid == view.rigid
            && self.links == view.links
            && self.node_colours == view.node_colours;
        if is_same {
            return;
        }
        view.nodes.clone_into(&mut self.nodes);
        view.rigid.clone_into(&mut self.rigid);
        view.links.clone_into(&mut self.links);
        view.node_colours.clone_into(&mut self.node_colours);
        self.meshes.iter_mut().flatten().for_each(|mesh| *mesh = None);
        self.shadow_hidden_id = None;
    }

    /// A level of detail of object `index` in the adopted state.
    pub(crate) fn mesh(
        &mut self,
        index: usize,
        object: &RenderObject,
        level: usize,
        lod: &Lod,
        view: &FrameView,
    ) -> Result<Arc<PosedMesh>, CameraError> {
        let mesh = &mut self.meshes[index][level];
        match mesh {
            Some(known) => Ok(known.clone()),
            None => Ok(mesh.insert(Arc::new(PosedMesh::new(object, lod, view)?)).clone()),
        }
    }

    /// Draws the shadows of `objects`, unless they are known.
    pub(crate) fn draw_shadow(&mut self, hidden_id: u16, objects: &[PosedObject]) {
        if self.shadow_hidden_id == Some(hidden_id) {
            return;
        }
        self.shadow_hidden_id = Some(hidden_id);
        let casters = objects.iter().filter(|o| o.object.casts_shadow && o.is_moving && !o.is_hidden);
        self.shadow
            .draw(casters.map(|o| (o.caster.posed.positions.as_slice(), o.caster.lod.triangles.as_slice())));
    }

    pub(crate) fn shadow(&self) -> &ShadowMap {
        &self.shadow
    }
}
