"""Checks rendered manifests: each object against its schema, and all of them against the rules of this service.

Called by scripts/check-deploy with one file for each overlay.
"""

import re
import sys
from pathlib import Path
from urllib.parse import urlsplit

import jsonschema
import kubernetes_validate
import yaml

# The oldest Kubernetes that deploy/README.md promises, and the newest whose schemas we have.
KUBERNETES = ["1.30", "1.37"]

# The settings of the service. An unknown variable would do nothing, silently.
SETTINGS = {
    "SPRINGLINE_" + name
    for name in """
    LISTEN METRICS_LISTEN LOG LOG_FORMAT WORKERS QUEUE QUEUE_SHARE CONNECTIONS COMPRESSION MEMORY MAX_BODY MAX_DEPTH MAX_DEGREE MAX_POINTS
    MAX_CONTROL_POINTS MAX_SEGMENTS MAX_SAMPLES MAX_ANSWER_POINTS HEADER_TIME BODY_TIME DEADLINE IDLE_TIME
    ANSWER_TIME GRACE DRAIN API_KEYS API_KEYS_FILE CORS_ORIGINS TLS_CERT TLS_KEY OTLP_ENDPOINT CONFIG
    """.split()
}
GRACE, DRAIN = "5s", "35s"  # the defaults of the service
USER = 65532  # as in the Dockerfile

NAME = "app.kubernetes.io/name"
QUANTITY = re.compile(r"\d+(\.\d+)?(m|k|[KMGT]i|[MGT])?")
SECONDS = {"ms": 0.001, "s": 1, "m": 60}


class Overlay:
    """The objects of one file, and what is wrong with them."""

    def __init__(self, path):
        self.name = Path(path).stem
        self.objects = [item for item in yaml.safe_load_all(Path(path).read_text()) if item]
        self.problems = []

    def expect(self, condition, problem):
        if not condition:
            self.problems.append(problem)

    def all(self, kind):
        return [item for item in self.objects if item["kind"] == kind]

    def one(self, kind):
        found = self.all(kind)
        if len(found) != 1:
            raise LookupError(f"expected one {kind}, found {len(found)}")
        return found[0]

    def named(self, kind, name):
        return next((item for item in self.all(kind) if item["metadata"]["name"] == name), None)


# Schemas


def service_monitor_schema():
    """The schema of prometheus-operator's CRD, by way of the models generated from it, closed against unknown fields."""
    from cloudcoil.models.prometheus_operator.v1 import ServiceMonitor

    def close(node):
        if isinstance(node, dict):
            if "properties" in node:
                node.setdefault("additionalProperties", False)
            node = list(node.values())
        if isinstance(node, list):
            for item in node:
                close(item)

    schema = ServiceMonitor.model_json_schema()
    close(schema)
    return schema


def check_schemas(overlay, service_monitor):
    for item in overlay.objects:
        label = f"{item['kind']} {item['metadata']['name']}"
        if item["apiVersion"] == "monitoring.coreos.com/v1" and item["kind"] == "ServiceMonitor":
            for error in jsonschema.Draft202012Validator(service_monitor).iter_errors(item):
                overlay.problems.append(f"{label}: {error.json_path}: {error.message}")
            continue
        for version in KUBERNETES:
            try:
                kubernetes_validate.validate(item, version, strict=True)
            except kubernetes_validate.ValidationError as error:
                overlay.problems.append(f"{label}: {error.json_path}: {error.message} (Kubernetes {version})")
            except kubernetes_validate.SchemaNotFoundError as error:
                overlay.problems.append(f"{label}: {error.message}")


# Rules


def check_rules(overlay):
    deployment = overlay.one("Deployment")
    pod = deployment["spec"]["template"]["spec"]
    labels = deployment["spec"]["template"]["metadata"]["labels"]
    container = next(c for c in pod["containers"] if c["name"] == "springline")
    settings = check_settings(overlay, container)
    ports = {port["name"]: port["containerPort"] for port in container["ports"]}

    check_names(overlay)
    check_security(overlay, pod)
    check_resources(overlay, container)
    check_probes(overlay, container)
    check_rollout(overlay, deployment, settings)
    check_ports(overlay, settings, ports, labels)
    check_egress(overlay, settings, labels)
    check_keys(overlay, settings, pod, container)


def check_names(overlay):
    names = [(item["kind"], item["metadata"]["name"]) for item in overlay.objects]
    overlay.expect(len(names) == len(set(names)), f"two objects of one kind and name: {names}")


def check_settings(overlay, container):
    settings = {}
    for source in container.get("envFrom", []):
        config_map = overlay.named("ConfigMap", source["configMapRef"]["name"])
        overlay.expect(config_map, f"envFrom: no ConfigMap {source['configMapRef']['name']}")
        settings.update((config_map or {}).get("data", {}))
    settings.update({entry["name"]: entry.get("value") for entry in container.get("env", [])})
    for name in settings:
        overlay.expect(name in SETTINGS, f"{name} is not a setting of the service")
    return settings


def check_security(overlay, pod):
    overlay.expect(pod.get("automountServiceAccountToken") is False, "the service account's token is mounted")
    overlay.expect(pod.get("enableServiceLinks") is False, "service links: variables of a Service look like settings")
    for name in ["hostNetwork", "hostPID", "hostIPC"]:
        overlay.expect(not pod.get(name), f"{name} is on")
    for volume in pod.get("volumes", []):
        overlay.expect("hostPath" not in volume, f"volume {volume['name']} is a hostPath")
    for container in pod["containers"] + pod.get("initContainers", []):
        context = pod.get("securityContext", {}) | container.get("securityContext", {})
        for key, wanted in {
            "runAsNonRoot": True,
            "runAsUser": USER,
            "runAsGroup": USER,
            "seccompProfile": {"type": "RuntimeDefault"},
            "allowPrivilegeEscalation": False,
            "readOnlyRootFilesystem": True,
            "capabilities": {"drop": ["ALL"]},
        }.items():
            found = context.get(key)
            overlay.expect(found == wanted, f"container {container['name']}: {key} is {found}, not {wanted}")
        overlay.expect(not context.get("privileged"), f"container {container['name']} is privileged")
        image = container["image"].rpartition("/")[2]
        overlay.expect(
            "@" in image or (":" in image and not image.endswith(":latest")), f"image {image} is of no fixed version"
        )


def check_resources(overlay, container):
    requests = container["resources"].get("requests", {})
    limits = container["resources"].get("limits", {})
    overlay.expect("cpu" in requests, "no CPU request: the autoscaler has nothing to measure against")
    overlay.expect("cpu" not in limits, "a CPU limit")
    memory = requests.get("memory"), limits.get("memory")
    overlay.expect(memory[0] and memory[0] == memory[1], f"memory request and limit differ: {memory}")
    for quantity in [*requests.values(), *limits.values()]:
        overlay.expect(QUANTITY.fullmatch(str(quantity)), f"{quantity} is no quantity")


def check_probes(overlay, container):
    for probe, path in {"startupProbe": "/livez", "livenessProbe": "/livez", "readinessProbe": "/readyz"}.items():
        get = container.get(probe, {}).get("httpGet", {})
        overlay.expect(get.get("path") == path, f"{probe} asks {get.get('path')}, not {path}")
        overlay.expect(get.get("port") == "http", f"{probe} asks port {get.get('port')}, not http")


def seconds(duration):
    number, unit = re.fullmatch(r"(\d+)(ms|s|m)", duration).groups()
    return int(number) * SECONDS[unit]


def check_rollout(overlay, deployment, settings):
    spec = deployment["spec"]
    pod = spec["template"]["spec"]
    labels = spec["template"]["metadata"]["labels"]
    stop = seconds(settings.get("SPRINGLINE_GRACE", GRACE)) + seconds(settings.get("SPRINGLINE_DRAIN", DRAIN))
    period = pod.get("terminationGracePeriodSeconds", 30)
    overlay.expect(period > stop, f"killed after {period} s, but may take {stop} s to stop")
    rolling = spec["strategy"].get("rollingUpdate", {})
    overlay.expect(rolling.get("maxUnavailable") == 0, "a rollout takes ready pods away")
    overlay.expect(spec["selector"]["matchLabels"].items() <= labels.items(), "the Deployment does not select its pods")

    scaler = overlay.one("HorizontalPodAutoscaler")["spec"]
    overlay.expect("replicas" not in spec, "replicas are set by the Deployment and by the autoscaler")
    target = scaler["scaleTargetRef"]
    overlay.expect(
        (target["kind"], target["name"]) == ("Deployment", deployment["metadata"]["name"]), f"autoscaler of {target}"
    )
    budget = overlay.one("PodDisruptionBudget")["spec"]
    overlay.expect(budget["selector"]["matchLabels"].items() <= labels.items(), "the disruption budget has other pods")
    overlay.expect(budget["maxUnavailable"] < scaler["minReplicas"], "the disruption budget allows to stop all pods")


def check_ports(overlay, settings, ports, labels):
    listen = {
        "http": settings.get("SPRINGLINE_LISTEN"),
        "metrics": settings.get("SPRINGLINE_METRICS_LISTEN"),
    }
    for name, address in listen.items():
        overlay.expect(
            address in (f"0.0.0.0:{ports.get(name)}", f"[::]:{ports.get(name)}"),
            f"the container port {name} is {ports.get(name)}, but the service listens on {address}",
        )
    overlay.expect(ports.keys() == listen.keys(), f"container ports {sorted(ports)}")

    for service in overlay.all("Service"):
        label = f"Service {service['metadata']['name']}"
        overlay.expect(service["spec"]["selector"].items() <= labels.items(), f"{label} selects other pods")
        for port in service["spec"]["ports"]:
            overlay.expect(port["targetPort"] in ports, f"{label}: no container port {port['targetPort']}")
    main = overlay.named("Service", "springline")
    overlay.expect(main, "no Service springline")
    targets = [port["targetPort"] for port in main["spec"]["ports"]] if main else ["http"]
    overlay.expect(targets == ["http"], f"Service springline leads to {targets}")

    allowed = {
        port["port"]
        for policy in policies(overlay, labels, "Ingress")
        for rule in policy.get("ingress", [])
        for port in rule.get("ports", [{"port": "all"}])
    }
    overlay.expect(allowed == set(ports.values()), f"network policy lets in to {allowed}, ports are {ports}")

    for monitor in overlay.all("ServiceMonitor"):
        wanted = monitor["spec"]["selector"]["matchLabels"].items()
        services = [s for s in overlay.all("Service") if wanted <= s["metadata"].get("labels", {}).items()]
        overlay.expect(len(services) == 1, f"the ServiceMonitor finds {len(services)} Services")
        for endpoint in monitor["spec"]["endpoints"]:
            targets = [p["targetPort"] for s in services for p in s["spec"]["ports"] if p["name"] == endpoint["port"]]
            overlay.expect(targets == ["metrics"], f"the ServiceMonitor's port {endpoint['port']} leads to {targets}")
            overlay.expect(endpoint["path"] == "/metrics", f"the ServiceMonitor asks {endpoint['path']}")


def policies(overlay, labels, direction):
    found = []
    for policy in overlay.all("NetworkPolicy"):
        overlay.expect(
            policy["spec"]["podSelector"].get("matchLabels", {}).items() <= labels.items(),
            f"NetworkPolicy {policy['metadata']['name']} selects other pods",
        )
        if direction in policy["spec"].get("policyTypes", []):
            found.append(policy["spec"])
    overlay.expect(found, f"{direction} is not restricted")
    return found


def check_egress(overlay, settings, labels):
    endpoint = settings.get("SPRINGLINE_OTLP_ENDPOINT")
    overlay.expect(overlay.name != "base" or endpoint is None, "the base sends traces")
    rules = [rule for policy in policies(overlay, labels, "Egress") for rule in policy.get("egress", [])]
    for rule in rules:
        overlay.expect(rule.get("to") and rule.get("ports"), f"egress to everywhere or to every port: {rule}")
    allowed = {port["port"] for rule in rules for port in rule.get("ports", [])}
    # To a collector, and to the name server for its name.
    wanted = {53, urlsplit(endpoint).port} if endpoint else set()
    overlay.expect(allowed == wanted, f"network policy lets out to {allowed or 'nothing'}, needed is {wanted or 'nothing'}")


def check_keys(overlay, settings, pod, container):
    overlay.expect("SPRINGLINE_API_KEYS" not in settings, "API keys in plain sight")
    file = settings.get("SPRINGLINE_API_KEYS_FILE")
    mounts = {mount["mountPath"]: mount for mount in container.get("volumeMounts", [])}
    if file is None:
        overlay.expect(not mounts, f"mounts that no setting uses: {sorted(mounts)}")
        return
    mount = mounts.get(str(Path(file).parent))
    if mount is None:
        overlay.problems.append(f"nothing is mounted where {file} should be")
        return
    overlay.expect("subPath" not in mount, "a subPath mount never sees new keys")
    overlay.expect(mount.get("readOnly") is True, "the API keys are mounted writable")
    volume = next((v for v in pod.get("volumes", []) if v["name"] == mount["name"]), {})
    overlay.expect("secret" in volume, f"the volume {mount['name']} is not a Secret")
    overlay.expect(not volume.get("secret", {}).get("optional"), "the Secret with the keys is optional")


def main(paths):
    service_monitor = service_monitor_schema()
    failed = False
    for path in paths:
        overlay = Overlay(path)
        check_schemas(overlay, service_monitor)
        try:
            check_rules(overlay)
        except (LookupError, TypeError, AttributeError, StopIteration) as error:
            # A rule found something of another shape than it reads.
            overlay.problems.append(f"cannot be checked: {error!r}")
        failed |= bool(overlay.problems)
        print(f"{overlay.name}: {len(overlay.objects)} objects, " + ("not as they must be" if overlay.problems else "ok"))
        for problem in overlay.problems:
            print(f"  {problem}")
    return 1 if failed or not paths else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
