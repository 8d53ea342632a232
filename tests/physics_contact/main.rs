//! Contact in the real world: soft on soft, rigid on rigid, and all kinds of body in one solve, against closed forms.

#[path = "../bodies/mod.rs"]
mod bodies;
mod gel;
mod mixed;
mod rigid;
mod rounded;
mod scans;
mod scene;
mod sleep;
mod soft;
mod solids;
