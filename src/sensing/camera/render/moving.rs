//! The moving objects in the state of the last image. The images of all cameras in that state share their meshes and
//! shadows.

use super::pass::PosedObject;
use crate::camera::{
    scene::{FrameView, PosedMeshes, RenderScene, RestState},
    shade::shadow::ShadowMap,
};

/// The moving objects of a scene in one state.
#[derive(Debug)]
pub(crate) struct MovingObjects {
    state: RestState,
    node_colours: Vec<Vec<[f32; 3]>>,
    pub(crate) meshes: PosedMeshes,
    shadow: ShadowMap,
    /// Segmentation id that the shadows leave out; `None` if they are not drawn yet.
    shadow_hidden_id: Option<u16>,
}

impl MovingObjects {
    pub(crate) fn new(scene: &RenderScene) -> Self {
        Self {
            state: RestState::default(),
            node_colours: Vec::new(),
            meshes: PosedMeshes::new(&scene.objects),
            shadow: ShadowMap::new(&scene.lighting),
            shadow_hidden_id: None,
        }
    }

    /// Adopts a state: what was made of another one is dropped.
    pub(crate) fn adopt(&mut self, view: &FrameView) {
        let RestState { nodes, rigid, links } = &mut self.state;
        let is_same = nodes == view.nodes
            && rigid == view.rigid
            && links == view.links
            && self.node_colours == view.node_colours;
        if is_same {
            return;
        }
        view.nodes.clone_into(nodes);
        view.rigid.clone_into(rigid);
        view.links.clone_into(links);
        view.node_colours.clone_into(&mut self.node_colours);
        self.meshes.clear();
        self.shadow_hidden_id = None;
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
