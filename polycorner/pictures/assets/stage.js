"use strict";

// Bodies and contacts, drawn with three.js (the global THREE).  One Stage is one picture, on pages
// of films and on pages of applications.  Coordinates are those of the library.

class Stage {
  // host: the element to fill.  Without WebGL it shows a message, and all methods do nothing.
  constructor(host) {
    this.host = host;
    this.scene = new THREE.Scene();
    this.camera = new THREE.PerspectiveCamera(32, 1, 1, 4000);
    this.radius = 30;
    this.scene.add(this.camera);
    this.scene.add(new THREE.AmbientLight(0xffffff, 0.5));
    const lamp = new THREE.DirectionalLight(0xffffff, 0.6);
    lamp.position.set(-0.5, 0.8, 1);
    this.camera.add(lamp, lamp.target); // light comes over the observer's shoulder
    this.last = {};
    this.works = this.start();
    matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => this.repaint());
  }

  start() {
    // Without WebGL three.js would log an error.
    const probe = document.createElement("canvas");
    const context = probe.getContext("webgl2") || probe.getContext("webgl");
    if (!context) {
      this.host.textContent = "This browser cannot show three dimensions (no WebGL).";
      return false;
    }
    context.getExtension("WEBGL_lose_context")?.loseContext(); // browsers limit their number
    this.renderer = new THREE.WebGLRenderer({ antialias: true, alpha: true });
    this.renderer.outputEncoding = THREE.sRGBEncoding;
    this.renderer.setPixelRatio(Math.min(devicePixelRatio, 2));
    this.host.append(this.renderer.domElement);
    this.controls = new THREE.TrackballControls(this.camera, this.renderer.domElement);
    this.controls.staticMoving = true;
    this.controls.rotateSpeed = 2.5;
    this.controls.keys = ["", "", ""]; // no letters as shortcuts
    this.controls.addEventListener("change", () => this.ask());
    this.host.addEventListener("keydown", (event) => this.key(event));
    new ResizeObserver(() => this.resize()).observe(this.host);
    this.resize();
    this.view();
    const frame = () => {
      requestAnimationFrame(frame);
      this.controls.update(); // requests a frame if the view has changed
      if (this.asked) this.renderer.render(this.scene, this.camera);
      this.asked = false;
    };
    frame();
    return true;
  }

  ask() { this.asked = true; }

  resize() {
    const { clientWidth: width, clientHeight: height } = this.host;
    if (!width || !height) return;
    this.renderer.setSize(width, height);
    this.camera.aspect = width / height;
    this.camera.updateProjectionMatrix();
    this.controls.handleResize();
    this.ask();
  }

  // ------------------------------------------------------------------------------------- the view

  // Look at a ball of some radius about a point, from a direction and with a direction that
  // points up the page; remembered for the button that resets the view.
  frame(centre, radius, from = [0, -0.55, 1], up = [0, 1, 0]) {
    Object.assign(this, { centre, radius, from, up });
    this.view();
  }

  view() {
    if (!this.renderer) return;
    const target = new THREE.Vector3(...(this.centre ?? [0, 0, 0]));
    const narrow = Math.min(1, this.camera.aspect);
    const far = this.radius / Math.sin((this.camera.fov * Math.PI) / 360) / narrow;
    this.controls.target.copy(target);
    this.camera.up.set(...(this.up ?? [0, 1, 0]));
    const from = new THREE.Vector3(...(this.from ?? [0, 0, 1])).normalize();
    this.camera.position.copy(target).addScaledVector(from, far);
    Object.assign(this.camera, { near: far / 100, far: 20 * far });
    this.camera.updateProjectionMatrix();
    this.camera.lookAt(target);
    this.ask();
  }

  // Move the camera and its target by a vector.
  shift(by) {
    if (!this.renderer) return;
    for (const place of [this.camera.position, this.controls.target]) place.add(new THREE.Vector3(...by));
    this.ask();
  }

  // Keys of the picture in focus: arrows turn it, + and - zoom, 0 resets the view.
  key(event) {
    const turn = { ArrowLeft: [0, 1], ArrowRight: [0, -1], ArrowUp: [1, 1], ArrowDown: [1, -1] }[event.key];
    const zoom = { "+": 0.9, "-": 1 / 0.9 }[event.key];
    if (!turn && !zoom && event.key !== "0") return;
    event.preventDefault();
    event.stopPropagation();
    if (event.key === "0") return void this.view();
    const away = this.camera.position.clone().sub(this.controls.target);
    if (turn) {
      const side = this.camera.up.clone().cross(away).normalize();
      const rotation = new THREE.Quaternion();
      rotation.setFromAxisAngle(turn[0] ? side : this.camera.up.clone().normalize(), -0.12 * turn[1]);
      away.applyQuaternion(rotation);
      this.camera.up.applyQuaternion(rotation);
    }
    this.camera.position.copy(this.controls.target).add(away.multiplyScalar(zoom ?? 1));
    this.ask();
  }

  // --------------------------------------------------------------------------------- what is there

  style(name) {
    return getComputedStyle(document.documentElement).getPropertyValue(`--${name}`).trim();
  }

  // A colour of the style sheet; three.js computes with linear light.
  colour(name) {
    return new THREE.Color(this.style(name)).convertSRGBToLinear();
  }

  // Build everything again after a change of the colour scheme.
  repaint() {
    for (const [method, given] of Object.entries(this.last)) this[method](...given);
  }

  // Add an object under a name, in place of the former one.
  put(name, object) {
    const old = this.scene.getObjectByName(name);
    if (old) {
      old.removeFromParent();
      old.traverse((part) => {
        part.geometry?.dispose();
        part.material?.map?.dispose();
        part.material?.dispose();
      });
    }
    if (object) {
      object.name = name;
      this.scene.add(object);
    }
    this.ask();
    return object;
  }

  swarm(name, geometry, material, count) {
    const mesh = new THREE.InstancedMesh(geometry, material, count);
    mesh.frustumCulled = false; // its box does not follow the instances
    return this.put(name, mesh);
  }

  // ---------------------------------------------------------------------------------- films of bodies

  // Prepare a film of motion_pages.py: kinds with triangles, what stands still, and outlines.
  async build(film) {
    this.flat = film.flat;
    for (const kind of film.kinds) kind.meshes = await this.meshes(kind);
    for (const [k, thing] of film.still.entries()) {
      for (const mesh of await this.meshes({ ...thing, most: 1 })) this.put(`still ${k} ${mesh.name}`, mesh);
    }
    for (const [k, line] of film.lines.entries()) this.lines(`line ${k}`, [...(await floats(line))], film.tone);
    if (film.axes) this.axes(film.axes.names, film.axes.origin, film.axes.length);
    if (!this.works || !film.flat) return;
    this.controls.noRotate = true; // the plane is seen from above; dragging moves it
    this.controls.mouseButtons = { LEFT: THREE.MOUSE.PAN, MIDDLE: THREE.MOUSE.DOLLY, RIGHT: THREE.MOUSE.PAN };
    this.controls.staticMoving = true;
    this.renderer.clippingPlanes = film.clip.map(([x, y, c]) => new THREE.Plane(new THREE.Vector3(x, y, 0), c));
  }

  // The layers of a kind, each drawn once for every body.
  async meshes({ layers, most }) {
    if (!this.works) return [];
    const made = [];
    for (const { colour, vertices, faces, normals } of layers) {
      const geometry = new THREE.BufferGeometry();
      geometry.setAttribute("position", new THREE.BufferAttribute(await floats(vertices), 3));
      geometry.setAttribute("normal", new THREE.BufferAttribute(await floats(normals), 3));
      geometry.setIndex(new THREE.BufferAttribute(await counts(faces), 1));
      const named = colour.startsWith("--") ? this.style(colour.slice(2)) : colour;
      const paint = { color: new THREE.Color(named).convertSRGBToLinear() };
      const material = this.flat ? new THREE.MeshBasicMaterial({ ...paint, side: THREE.DoubleSide })
        : new THREE.MeshStandardMaterial({ ...paint, roughness: 0.5, metalness: 0 });
      const mesh = new THREE.InstancedMesh(geometry, material, most);
      mesh.frustumCulled = false; // its box does not follow the instances
      mesh.name = `layer ${made.length}`;
      if (most === 1) mesh.setMatrixAt(0, new THREE.Matrix4());
      this.scene.add(mesh);
      made.push(mesh);
    }
    return made;
  }

  // Show the bodies of a film at an instant, with their images.
  place(film, k) {
    if (!this.works) return;
    const matrix = new THREE.Matrix4(), spot = new THREE.Vector3(), turn = new THREE.Quaternion(), one = new THREE.Vector3(1, 1, 1);
    let body = k * film.count;
    for (const kind of film.kinds) {
      let seen = 0;
      for (let j = 0; j < kind.count; j++, body++) {
        if (Number.isNaN(film.centres[3 * body])) continue; // it has left
        turn.fromArray(film.turns, 4 * body);
        for (const shift of film.shifts) {
          spot.fromArray(film.centres, 3 * body).add(new THREE.Vector3(...shift));
          if (film.shifts.length > 1 && [0, 1].some((a) => spot.getComponent(a) < film.box.low[a] - kind.size || spot.getComponent(a) > film.box.high[a] + kind.size)) continue;
          matrix.compose(spot, turn, one);
          for (const mesh of kind.meshes) mesh.setMatrixAt(seen, matrix);
          seen += 1;
        }
      }
      for (const mesh of kind.meshes) {
        mesh.count = seen;
        mesh.instanceMatrix.needsUpdate = true;
      }
    }
    this.ask();
  }

  // points: an array of [x, y, z].  They shine through what is in front of them.
  contacts(points, size) {
    this.last.contacts = [points, size];
    if (!this.works) return;
    const place = new THREE.Object3D();
    for (const [name, scale, opacity] of [["halo", 0.3, 0.45], ["core", 0.14, 1]]) {
      if (!points.length) {
        this.put(name, null);
        continue;
      }
      const material = new THREE.MeshBasicMaterial({
        color: this.colour("glow"), transparent: true, opacity, depthTest: false, depthWrite: false,
      });
      const mesh = this.swarm(name, new THREE.SphereGeometry(scale * size, 20, 14), material, points.length);
      mesh.renderOrder = name === "core" ? 3 : 2;
      points.forEach((point, k) => {
        place.position.fromArray(point);
        place.updateMatrix();
        mesh.setMatrixAt(k, place.matrix);
      });
    }
  }

  lines(name, numbers, tone = "grid") {
    const geometry = new THREE.BufferGeometry();
    geometry.setAttribute("position", new THREE.Float32BufferAttribute(numbers, 3));
    this.put(name, new THREE.LineSegments(geometry, new THREE.LineBasicMaterial({ color: this.colour(tone) })));
  }

  // Three arrows of a length from a point, with their names at the ends.
  axes(names, origin, length) {
    this.last.axes = [names, origin, length];
    if (!this.works) return;
    const group = new THREE.Group(), ends = [];
    names.forEach((name, k) => {
      const end = origin.map((value, j) => value + (j === k ? length : 0));
      ends.push(...origin, ...end);
      const sprite = this.letter(name);
      sprite.position.fromArray(end.map((value, j) => value + (j === k ? 0.22 * length : 0)));
      const { width, height } = sprite.material.map.image;
      sprite.scale.set((0.42 * length * width) / height, 0.42 * length, 1);
      group.add(sprite);
    });
    const geometry = new THREE.BufferGeometry();
    geometry.setAttribute("position", new THREE.Float32BufferAttribute(ends, 3));
    group.add(new THREE.LineSegments(geometry, new THREE.LineBasicMaterial({ color: this.colour("ink") })));
    this.put("axes", group);
  }

  letter(text) {
    const canvas = Object.assign(document.createElement("canvas"), { width: 48 + 40 * Math.max(text.length, 1.2), height: 96 });
    const pen = canvas.getContext("2d");
    Object.assign(pen, { font: "italic 64px serif", textAlign: "center", textBaseline: "middle" });
    pen.fillStyle = this.style("ink");
    pen.fillText(text, canvas.width / 2, 48);
    const map = new THREE.CanvasTexture(canvas);
    map.encoding = THREE.sRGBEncoding;
    const sprite = new THREE.Sprite(new THREE.SpriteMaterial({ map, depthTest: false }));
    sprite.renderOrder = 1; // after a translucent solid, which would pale it
    return sprite;
  }

  // --------------------------------------------------------------------------------------- atlases

  // Show a GLB file (an ArrayBuffer) instead of the last one; resolves to its bounding box.
  model(buffer) {
    if (!this.works) return Promise.resolve(null);
    return new Promise((resolve, reject) => {
      new THREE.GLTFLoader().parse(buffer, "", (found) => {
        this.put("model", found.scene);
        const box = new THREE.Box3().setFromObject(found.scene);
        resolve({ low: box.min.toArray(), high: box.max.toArray() });
      }, reject);
    });
  }

  // Look at the box of an atlas with the relative heading upwards, from where the figures of the
  // solid are seen: elevation 22 degrees, azimuth -35 degrees.
  frameBox({ low, high }) {
    const middle = low.map((value, k) => (value + high[k]) / 2);
    const [elevation, azimuth] = [22, -35].map((degrees) => (degrees * Math.PI) / 180);
    const from = [Math.cos(azimuth), Math.sin(azimuth), Math.tan(elevation)];
    this.frame(middle, 0.5 * Math.hypot(...low.map((value, k) => high[k] - value)), from, [0, 0, 1]);
  }

  // A path through the atlas and its current point; pieces: arrays of [x, y, z].
  way(pieces, point, radius) {
    this.last.way = [pieces, point, radius];
    if (!this.works) return;
    const group = new THREE.Group();
    // Declared transparent, so that it is drawn last, over the solid.
    const seen = (name) => new THREE.MeshBasicMaterial({ color: this.colour(name), depthTest: false, transparent: true });
    for (const piece of pieces) {
      if (piece.length < 2) continue;
      const curve = new THREE.CatmullRomCurve3(piece.map((p) => new THREE.Vector3(...p)));
      const tube = new THREE.TubeGeometry(curve, Math.min(4 * piece.length, 800), 0.45 * radius, 8);
      group.add(new THREE.Mesh(tube, seen("way")));
    }
    const mark = new THREE.Mesh(new THREE.SphereGeometry(radius, 24, 16), seen("here"));
    mark.position.fromArray(point);
    group.add(mark);
    group.children.forEach((part, k) => { part.renderOrder = 2 + k; });
    this.put("way", group);
  }
}
