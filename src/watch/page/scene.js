// The scene in three dimensions. Lengths are in m, z points up.
import {
  AxesHelper, BufferAttribute, BufferGeometry, Color, DirectionalLight, HemisphereLight, Mesh, MeshStandardMaterial,
  OrbitControls, PCFShadowMap, PerspectiveCamera, Points, PointsMaterial, Scene, Vector3, WebGLRenderer,
} from "./three.js";

// Colours of strain over stable strain: pale to orange up to 1, red beyond, never before.
const RAMP = [[0, [0xf1, 0xee, 0xe6]], [0.3, [0xf1, 0xee, 0xe6]], [0.65, [0xf5, 0xd7, 0x6e]], [1, [0xe8, 0x91, 0x3a]]];
const BEYOND = linear([0xb3, 0x26, 0x1e]);
const LOOK_FROM = [1.1, -0.75, 0.75], LOOK_AT = [0, 0, 0.1];
// Distance of the camera that follows the object, m.
const CLOSE = 0.28;

function linear(rgb) {
  const colour = new Color().setRGB(rgb[0] / 255, rgb[1] / 255, rgb[2] / 255, "srgb");
  return [colour.r, colour.g, colour.b];
}

// The colour of a strain over the stable one.
export function strainColour(ratio) {
  if (ratio > 1) return BEYOND;
  let k = 1;
  while (k < RAMP.length - 1 && ratio > RAMP[k][0]) k += 1;
  const [low, from] = RAMP[k - 1], [high, to] = RAMP[k];
  const share = Math.max(0, Math.min(1, (ratio - low) / (high - low)));
  return linear(from.map((value, i) => value + share * (to[i] - value)));
}

// Moves an object to a pose: position and quaternion x y z w.
function place(object, numbers, first) {
  object.position.fromArray(numbers, first);
  object.quaternion.fromArray(numbers, first + 3);
}

export class View {
  constructor(canvas) {
    this.canvas = canvas;
    this.renderer = new WebGLRenderer({ canvas, antialias: true, preserveDrawingBuffer: true });
    this.renderer.setPixelRatio(Math.min(2, devicePixelRatio));
    this.renderer.shadowMap.enabled = true;
    this.renderer.shadowMap.type = PCFShadowMap;
    this.scene = new Scene();
    this.scene.background = new Color(matchMedia("(prefers-color-scheme: dark)").matches ? 0x20242b : 0xdfe3e6);
    this.scene.add(new HemisphereLight(0xffffff, 0x8a8378, 1.6));
    const sun = new DirectionalLight(0xffffff, 2.2);
    sun.position.set(0.6, -0.9, 1.8);
    sun.castShadow = true;
    sun.shadow.mapSize.set(2048, 2048);
    Object.assign(sun.shadow.camera, { left: -0.8, right: 0.8, top: 0.8, bottom: -0.8, near: 0.1, far: 5 });
    sun.shadow.bias = -0.0005;
    this.scene.add(sun);
    this.camera = new PerspectiveCamera(40, 1, 0.01, 20);
    this.camera.up.set(0, 0, 1);
    this.camera.position.fromArray(LOOK_FROM);
    this.controls = new OrbitControls(this.camera, canvas);
    this.controls.target.fromArray(LOOK_AT);
    this.controls.update();
    this.commanded = new AxesHelper(0.06);
    this.commanded.material.depthTest = false;
    this.commanded.renderOrder = 2;
    this.points = new Points(
      new BufferGeometry(),
      new PointsMaterial({ size: 5, sizeAttenuation: false, color: 0x2f6fde, depthTest: false, transparent: true }),
    );
    this.points.renderOrder = 1;
    this.points.frustumCulled = false;
    this.scene.add(this.commanded, this.points);
    this.objects = [];
    this.options = { camera: "free", skin: "material", clear: false, contacts: true, commanded: true };
  }

  // Replaces the objects by those of a scene message.
  load(message) {
    for (const object of this.objects) {
      this.scene.remove(object.mesh);
      object.mesh.geometry.dispose();
      object.mesh.material.dispose();
    }
    this.cameras = message.cameras;
    this.bodies = message.bodies;
    this.objects = message.objects.map((entry) => this.add(message, entry));
    this.target = this.objects.find((object) => object.entry.target);
    this.followed = null;
  }

  add(message, entry) {
    const geometry = new BufferGeometry();
    const colours = Float32Array.from(message.bytes(entry.colours), (byte) => (byte / 255) ** 2);
    geometry.setAttribute("position", new BufferAttribute(message.floats(entry.positions).slice(), 3));
    geometry.setAttribute("normal", new BufferAttribute(message.floats(entry.normals).slice(), 3));
    geometry.setAttribute("color", new BufferAttribute(colours.slice(), 3));
    geometry.setIndex(new BufferAttribute(message.indices(entry.triangles), 1));
    const material = new MeshStandardMaterial({ vertexColors: true, roughness: entry.roughness, transparent: entry.robot });
    const mesh = new Mesh(geometry, material);
    mesh.castShadow = entry.pose === undefined;
    mesh.receiveShadow = true;
    mesh.frustumCulled = entry.soft === undefined;
    if (entry.pose) place(mesh, entry.pose, 0);
    this.scene.add(mesh);
    const object = { entry, mesh, colours };
    if (entry.soft !== undefined) {
      object.nodes = message.indices(entry.nodes);
      object.weights = message.floats(entry.weights);
    }
    return object;
  }

  // Shows a state message.
  show(state) {
    const poses = state.floats(state.poses);
    for (const object of this.objects) {
      if (object.entry.moving !== undefined) place(object.mesh, poses, 7 * object.entry.moving);
      if (object.entry.soft !== undefined) this.deform(object, state);
      if (object.entry.robot) {
        object.mesh.material.opacity = this.options.clear ? 0.25 : 1;
        object.mesh.material.depthWrite = !this.options.clear;
        object.mesh.castShadow = !this.options.clear;
      }
    }
    this.commanded.visible = this.options.commanded && state.commanded !== null;
    if (state.commanded) place(this.commanded, state.commanded, 0);
    const contacts = state.floats(state.contacts);
    const positions = new Float32Array((3 * contacts.length) / 4);
    for (let i = 0; i < contacts.length / 4; i += 1) positions.set(contacts.subarray(4 * i, 4 * i + 3), 3 * i);
    this.points.geometry.dispose();
    this.points.geometry = new BufferGeometry();
    this.points.geometry.setAttribute("position", new BufferAttribute(positions, 3));
    this.points.visible = this.options.contacts && positions.length > 0;
    this.aim(state);
  }

  // Moves the vertices of a soft body with its nodes, and colours them by strain if asked for.
  deform(object, state) {
    const { nodes, weights, mesh, colours } = object;
    const body = state.soft[object.entry.soft], x = state.floats(body.nodes), strains = state.floats(body.strains);
    const position = mesh.geometry.attributes.position, colour = mesh.geometry.attributes.color;
    const stable = this.bodies[object.entry.soft].stable_strain;
    const by_strain = this.options.skin === "strain" && stable !== null;
    for (let v = 0; v < position.count; v += 1) {
      let px = 0, py = 0, pz = 0, strain = 0;
      for (let k = 8 * v; k < 8 * v + 8; k += 1) {
        const n = nodes[k], w = weights[k];
        px += w * x[3 * n];
        py += w * x[3 * n + 1];
        pz += w * x[3 * n + 2];
        strain += w * strains[n];
      }
      position.setXYZ(v, px, py, pz);
      if (by_strain) colour.setXYZ(v, ...strainColour(strain / stable));
    }
    if (!by_strain) colour.array.set(colours);
    position.needsUpdate = true;
    colour.needsUpdate = true;
    mesh.geometry.computeVertexNormals();
    mesh.geometry.computeBoundingSphere();
  }

  // Centre of the target, world.
  centre() {
    const { mesh, entry } = this.target;
    if (!mesh.geometry.boundingSphere) mesh.geometry.computeBoundingSphere();
    const centre = mesh.geometry.boundingSphere.center.clone();
    return entry.soft === undefined ? mesh.localToWorld(centre) : centre;
  }

  // Places the camera: where the user left it, around the target, or as a camera of the scene.
  aim(state) {
    const { camera, controls, options } = this;
    const own = this.cameras.findIndex((one) => one.name === options.camera);
    controls.enabled = own < 0;
    if (own >= 0) {
      camera.fov = (180 / Math.PI) * this.cameras[own].fovy;
      place(camera, state.cameras[own], 0);
    } else {
      camera.fov = 40;
      if (options.camera === "target" && this.target) {
        const centre = this.centre();
        if (this.followed) camera.position.add(centre.clone().sub(this.followed));
        else camera.position.copy(centre).add(new Vector3(0.75, -0.45, 0.5).normalize().multiplyScalar(CLOSE));
        controls.target.copy(centre);
        this.followed = centre;
      }
      controls.update();
    }
    if (options.camera !== "target") this.followed = null;
    camera.updateProjectionMatrix();
  }

  // Leaves the view of a camera of the scene where the user can go on from.
  release() {
    this.camera.position.fromArray(LOOK_FROM);
    this.controls.target.fromArray(LOOK_AT);
    this.controls.update();
  }

  draw() {
    const { clientWidth: width, clientHeight: height } = this.canvas.parentElement;
    const ratio = this.renderer.getPixelRatio();
    if (this.canvas.width !== Math.floor(width * ratio) || this.canvas.height !== Math.floor(height * ratio)) {
      this.renderer.setSize(width, height, false);
      this.camera.aspect = width / height;
      this.camera.updateProjectionMatrix();
    }
    if (this.controls.enabled) this.controls.update();
    this.renderer.render(this.scene, this.camera);
  }
}
