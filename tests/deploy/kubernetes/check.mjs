// Checks deploy/kubernetes without a cluster: node check.mjs REPOSITORY [--break NAME]
//
// Every kustomization is put together (resources, patches), and every object of it is
//   - validated against its schema (formats, enums, what is required),
//   - compiled as a TypeScript literal of its type, which refuses fields that the API does not have,
//   - compared with the others: selectors, secrets, ports, names.
// Prints a problem a line and exits with 1 if there are any. --break NAME damages the objects in memory first, in
// one of the ways below; then problems are expected.
import fs from "node:fs";
import path from "node:path";
import { createRequire } from "node:module";
import yaml from "js-yaml";
import ts from "typescript";

const [repository, flag, breakage] = process.argv.slice(2);
const root = path.join(repository, "deploy/kubernetes");
const problems = [];
const problem = (where, what) => problems.push(`${where}: ${what}`);

// --- kustomize, as much of it as is used here -------------------------------------------------------------------
const KNOWN = new Set(["apiVersion", "kind", "namespace", "resources", "images", "patches"]);

function documents(file) {
  return yaml.loadAll(fs.readFileSync(file, "utf8")).filter((d) => d).map((d) => ({ ...d, file }));
}

// Lists by name are those that a strategic merge patch takes item by item; null takes a field out.
const BY_NAME = new Set(["containers", "volumes", "env"]);

function merge(into, patch, list) {
  if (BY_NAME.has(list) && Array.isArray(into) && Array.isArray(patch)) {
    for (const item of patch) {
      const found = into.findIndex((i) => i.name === item.name);
      if (found >= 0) into[found] = merge(into[found], item);
      else if (list === "containers") throw new Error(`the patch names ${item.name}, which is not there`);
      else into.push(item);
    }
    return into;
  }
  if (into && patch && typeof into === "object" && typeof patch === "object" && !Array.isArray(patch)) {
    for (const [key, value] of Object.entries(patch)) {
      if (value === null) delete into[key];
      else into[key] = key in into ? merge(into[key], value, key) : value;
    }
    return into;
  }
  return patch;
}

function build(folder) {
  const file = path.join(folder, "kustomization.yaml");
  const kustomization = yaml.load(fs.readFileSync(file, "utf8"));
  for (const key of Object.keys(kustomization)) if (!KNOWN.has(key)) problem(file, `unknown field ${key}`);
  if (kustomization.namespace !== "lightmill") problem(file, "the namespace is another");
  const objects = [];
  for (const resource of kustomization.resources) {
    const at = path.join(folder, resource);
    if (!fs.existsSync(at)) problem(file, `no ${resource}`);
    else objects.push(...(fs.statSync(at).isDirectory() ? build(at) : documents(at)));
  }
  for (const { target, patch } of kustomization.patches ?? []) {
    const object = objects.find((o) => o.kind === target.kind && o.metadata.name === target.name);
    if (!object) problem(file, `no ${target.kind} ${target.name} to patch`);
    else merge(object, yaml.load(patch));
  }
  for (const image of kustomization.images ?? []) {
    const used = objects.some((o) => o.spec?.template?.spec?.containers?.some((c) => c.image === image.name));
    if (!used) problem(file, `no container has the image ${image.name}`);
  }
  return objects;
}

// --- one object ---------------------------------------------------------------------------------------------------
const PACKAGES = { "keda.sh/v1alpha1": "@kubernetes-models/keda/keda.sh/v1alpha1", "monitoring.coreos.com/v1": "@kubernetes-models/prometheus-operator/monitoring.coreos.com/v1" };
const GROUPS = { policy: "policy", apps: "apps", autoscaling: "autoscaling" };
const require = createRequire(import.meta.url);

function module_of(object) {
  if (PACKAGES[object.apiVersion]) return `${PACKAGES[object.apiVersion]}/${object.kind}`;
  const [group, version] = object.apiVersion.includes("/") ? object.apiVersion.split("/") : ["", object.apiVersion];
  return ["kubernetes-models", ...(group ? [GROUPS[group] ?? group] : []), version, object.kind].join("/");
}

function without_file({ file, ...object }) {
  return object;
}

function check_schemas(objects) {
  const sources = new Map();
  objects.forEach((object, index) => {
    const where = `${object.file}: ${object.kind} ${object.metadata?.name}`;
    let model;
    try {
      model = require(module_of(object))[object.kind];
    } catch {
      return problem(where, `${object.apiVersion} has no such kind`);
    }
    try {
      new model(without_file(object)).validate();
    } catch (error) {
      problem(where, error.message);
    }
    const literal = JSON.stringify(without_file(object), null, 1);
    sources.set(path.resolve(`object${index}.ts`), { where, text: `import type { I${object.kind} as Type } from "${module_of(object)}";\nexport const object: Type = ${literal};\n` });
  });
  const options = { strict: true, noEmit: true, skipLibCheck: true, module: ts.ModuleKind.CommonJS, moduleResolution: ts.ModuleResolutionKind.Node10, target: ts.ScriptTarget.ES2022, types: [] };
  const host = ts.createCompilerHost(options);
  const { getSourceFile, fileExists, readFile } = host;
  host.getSourceFile = (name, ...rest) => sources.has(name) ? ts.createSourceFile(name, sources.get(name).text, options.target) : getSourceFile.call(host, name, ...rest);
  host.fileExists = (name) => sources.has(name) || fileExists.call(host, name);
  host.readFile = (name) => sources.get(name)?.text ?? readFile.call(host, name);
  const program = ts.createProgram([...sources.keys()], options, host);
  for (const found of ts.getPreEmitDiagnostics(program)) {
    const source = sources.get(found.file?.fileName);
    const line = source?.text.slice(0, found.start).split("\n").length;
    problem(source?.where ?? "compiler", ts.flattenDiagnosticMessageText(found.messageText, " ") + (source ? ` (${source.text.split("\n")[line - 1].trim()})` : ""));
  }
}

// --- all of them together -------------------------------------------------------------------------------------------
function check_together(objects) {
  const of = (kind) => objects.filter((o) => o.kind === kind);
  const workloads = [...of("Deployment"), ...of("StatefulSet")];
  const labels_fit = (selector, labels) => Object.entries(selector).every(([k, v]) => labels[k] === v);
  const selects_a_pod = (where, selector) => {
    if (!workloads.some((w) => labels_fit(selector, w.spec.template.metadata.labels))) problem(where, `selects no pod: ${JSON.stringify(selector)}`);
  };
  for (const w of workloads) {
    const where = `${w.file}: ${w.kind} ${w.metadata.name}`;
    if (!labels_fit(w.spec.selector.matchLabels, w.spec.template.metadata.labels)) problem(where, "its selector does not fit its own pods");
    const pod = w.spec.template.spec;
    const volumes = new Set([...(pod.volumes ?? []), ...(w.spec.volumeClaimTemplates ?? []).map((c) => c.metadata)].map((v) => v.name));
    for (const c of pod.containers) {
      for (const probe of ["startupProbe", "readinessProbe", "livenessProbe"]) {
        const target = c[probe]?.httpGet ?? c[probe]?.tcpSocket;
        if (c[probe]?.exec) continue;
        if (!target) problem(where, `no ${probe}`);
        else if (!c.ports.some((p) => p.name === target.port)) problem(where, `${probe}: no port ${target.port}`);
      }
      for (const kind of ["cpu", "memory"]) if (!c.resources?.limits?.[kind]) problem(where, `no limit of ${kind}`);
      for (const mount of c.volumeMounts) if (!volumes.has(mount.name)) problem(where, `no volume ${mount.name}`);
      if (!c.securityContext?.readOnlyRootFilesystem || !pod.securityContext?.runAsNonRoot) problem(where, "not hardened");
    }
    if (w.metadata.name === "lightmill-worker") {
      const drain = Number(pod.containers[0].args[pod.containers[0].args.indexOf("--drain-timeout") + 1]);
      if (!(pod.terminationGracePeriodSeconds > drain)) problem(where, "it is killed before its drain is over");
      if (!pod.containers[0].lifecycle?.preStop) problem(where, "no preStop");
    }
  }
  for (const s of of("Service")) {
    const where = `${s.file}: Service ${s.metadata.name}`;
    selects_a_pod(where, s.spec.selector);
    const ports = workloads.filter((w) => labels_fit(s.spec.selector, w.spec.template.metadata.labels)).flatMap((w) => w.spec.template.spec.containers.flatMap((c) => c.ports));
    for (const p of s.spec.ports) if (!ports.some((q) => q.name === p.targetPort)) problem(where, `no port ${p.targetPort}`);
  }
  for (const o of of("PodDisruptionBudget")) selects_a_pod(o.file, o.spec.selector.matchLabels);
  for (const o of of("NetworkPolicy")) selects_a_pod(o.file, o.spec.podSelector.matchLabels);
  for (const o of of("PodMonitor")) selects_a_pod(o.file, o.spec.selector.matchLabels);
  for (const o of of("ServiceMonitor")) if (!of("Service").some((s) => labels_fit(o.spec.selector.matchLabels, s.metadata.labels))) problem(o.file, "selects no service");
  for (const o of [...of("HorizontalPodAutoscaler"), ...of("ScaledObject")]) {
    const { name } = o.spec.scaleTargetRef;
    if (!workloads.some((w) => w.metadata.name === name)) problem(o.file, `no ${name} to scale`);
  }
  const claims = new Set(of("PersistentVolumeClaim").map((c) => c.metadata.name));
  for (const w of workloads) {
    for (const v of w.spec.template.spec.volumes ?? []) {
      const claim = v.persistentVolumeClaim?.claimName;
      if (claim && !claims.has(claim)) problem(w.file, `no claim ${claim}`);
    }
    // Addresses of single pods, as workers dial them.
    const dialled = w.spec.template.spec.containers.flatMap((c) => c.args ?? []).flatMap((a) => [...a.matchAll(/([a-z-]+)-(\d+)\.([a-z-]+):/g)]);
    for (const [text, set, ordinal, service] of dialled) {
      const found = of("StatefulSet").find((s) => s.metadata.name === set && s.spec.serviceName === service);
      if (!found || Number(ordinal) >= found.spec.replicas) problem(w.file, `no pod at ${text}`);
    }
  }
  for (const w of of("StatefulSet")) if (!of("Service").some((s) => s.metadata.name === w.spec.serviceName)) problem(w.file, `no service ${w.spec.serviceName}`);
}

/// Names and keys of the secrets that the objects use ("name" alone where all keys are mounted); what tests/deploy/kubernetes.sh compares with secrets.sh.
function secrets_used(objects) {
  const used = new Set();
  const walk = (value) => {
    if (!value || typeof value !== "object") return;
    if (value.secretName) for (const item of value.items ?? [{}]) used.add(`${value.secretName} ${item.key ?? ""}`.trim());
    if (value.key && value.name) used.add(`${value.name} ${value.key}`);
    Object.values(value).forEach(walk);
  };
  objects.forEach(walk);
  return used;
}

const BREAKAGES = {
  field: (o) => (o.find((x) => x.kind === "Deployment").spec.template.spec.containers[0].imagePullPolice = "Never"),
  enum: (o) => (o.find((x) => x.kind === "Deployment").spec.template.spec.containers[0].imagePullPolicy = "Sometimes"),
  type: (o) => (o.find((x) => x.kind === "StatefulSet").spec.replicas = "1"),
  required: (o) => delete o.find((x) => x.kind === "Deployment").spec.selector,
  label: (o) => (o.find((x) => x.kind === "PodDisruptionBudget").spec.selector.matchLabels = { "app.kubernetes.io/name": "nobody" }),
  drain: (o) => (o.find((x) => x.kind === "Deployment").spec.template.spec.terminationGracePeriodSeconds = 30),
  kind: (o) => (o.find((x) => x.kind === "Deployment").apiVersion = "apps/v1beta9"),
};

const OVERLAY_BREAKAGES = {
  claim: (o) => (o.find((x) => x.kind === "PersistentVolumeClaim").metadata.name = "another"),
  replicas: (o) => (o.find((x) => x.kind === "StatefulSet").spec.replicas = 1),
};

const folders = ["base", ...fs.readdirSync(path.join(root, "overlays")).map((o) => `overlays/${o}`)];
const secrets = new Set();
let count = 0;
for (const folder of !breakage ? folders : breakage in BREAKAGES ? ["base"] : ["overlays/standby"]) {
  const objects = build(path.join(root, folder));
  if (flag === "--break") ({ ...BREAKAGES, ...OVERLAY_BREAKAGES })[breakage](objects);
  check_schemas(objects);
  try {
    check_together(objects);
  } catch (error) {
    problem(folder, error.message);
  }
  secrets_used(objects).forEach((s) => secrets.add(s));
  count += objects.length;
}
if (flag === "--secrets") console.log([...secrets].sort().join("\n"));
else console.log(`${count} objects in ${folders.length} kustomizations`);
for (const line of problems) console.error(line.replace(`${repository}/`, ""));
process.exit(problems.length ? 1 : 0);
