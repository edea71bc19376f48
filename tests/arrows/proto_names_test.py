"""The protos keep buf's STANDARD rules of names (buf itself is not in Debian).

    proto_names_test.py
"""
import pathlib
import re
import sys

PROTO = pathlib.Path(__file__).resolve().parents[2] / "proto"
# RPCs whose messages are named otherwise, and why; an exception that is none is a problem, too.
EXCEPTIONS = {
    # The same scene goes to both. A message around it would escape the bound on its fields, which counts those of the
    # request itself (common/rpc/request_limits.h).
    "CheckScene": ("SceneRequest", "CheckSceneResponse"),
    "SubmitScene": ("SceneRequest", "SubmitSceneResponse"),
    # A file in parts, which HTTP sends as it stands: what google.api.HttpBody is elsewhere.
    "GetPicture": ("GetPictureRequest", "FileChunk"),
}
PASCAL, LOWER = r"[A-Z][A-Za-z0-9]*", r"[a-z][a-z0-9]*(_[a-z0-9]+)*"


def screaming(name):
    return re.sub(r"(?<=[a-z0-9])(?=[A-Z])", "_", name).upper()


def problems_of(path, text):
    """Lines that say what is wrong."""
    found = []
    text = re.sub(r"//[^\n]*", "", text)
    package = re.search(r"^package ([\w.]+);", text, re.M)
    folder = str(path.parent.relative_to(PROTO)).replace("/", ".")
    if not package or package[1] != folder or not re.fullmatch(r"[a-z0-9_.]+\.v\d+", folder):
        found.append(f"{path.name}: the package must be {folder} and end in a version")
    if not re.fullmatch(LOWER + r"\.proto", path.name):
        found.append(f"{path.name}: a file's name is lower_snake_case")
    for name, body in re.findall(r"\benum (\w+) \{(.*?)\}", text, re.S):
        values = re.findall(r"(\w+) = (\d+)", body)
        if not re.fullmatch(PASCAL, name):
            found.append(f"{path.name}: enum {name}: PascalCase")
        if ("0" not in dict((n, v) for v, n in values)
                or dict((n, v) for v, n in values)["0"] != screaming(name) + "_UNSPECIFIED"):
            found.append(f"{path.name}: enum {name}: zero is {screaming(name)}_UNSPECIFIED")
        found += [f"{path.name}: {value}: begins with {screaming(name)}_" for value, _ in values
                  if not re.fullmatch(screaming(name) + "_[A-Z0-9_]+", value)]
    for name in re.findall(r"\bmessage (\w+) \{", text):
        if not re.fullmatch(PASCAL, name):
            found.append(f"{path.name}: message {name}: PascalCase")
    without_enums = re.sub(r"\benum \w+ \{.*?\}", "", text, flags=re.S)
    field = r"(?:^|[{;])\s*(?:optional |repeated )?(?:map<[^>]*>|[\w.]+) (\w+) = \d+;"
    for name in re.findall(field, without_enums, re.M):
        if not re.fullmatch(LOWER, name):
            found.append(f"{path.name}: field {name}: lower_snake_case")
    for name in re.findall(r"\boneof (\w+) \{", text):
        if not re.fullmatch(LOWER, name):
            found.append(f"{path.name}: oneof {name}: lower_snake_case")
    for service, body in re.findall(r"\bservice (\w+) \{(.*?)\n\}", text, re.S):
        if not re.fullmatch(PASCAL + "Service", service):
            found.append(f"{path.name}: service {service}: PascalCase, and ends in Service")
        for rpc, request, response in re.findall(r"rpc (\w+)\((?:stream )?(\w+)\) returns \((?:stream )?(\w+)\)", body):
            usual = (rpc + "Request", rpc + "Response")
            wanted = EXCEPTIONS.get(rpc, usual)
            if (request, response) != wanted or not re.fullmatch(PASCAL, rpc):
                found.append(f"{path.name}: rpc {rpc}: takes {wanted[0]} and returns {wanted[1]}")
            if rpc in EXCEPTIONS and wanted == usual:
                found.append(f"{path.name}: rpc {rpc}: is no exception")
    return found


def main():
    files = sorted(PROTO.rglob("*.proto"))
    assert len(files) >= 3, "where are the protos?"
    found = [problem for path in files for problem in problems_of(path, path.read_text())]
    texts = "".join(path.read_text() for path in files)
    found += [f"there is no rpc {rpc}: drop the exception" for rpc in EXCEPTIONS if f"rpc {rpc}(" not in texts]
    # What it must find, or it finds nothing.
    bad = problems_of(PROTO / "lightmill/v1/Bad.proto", """
package lightmill.v2;
enum JobKind { UNKNOWN = 0; JOB_KIND_A = 1; }
message bad_one { string Name = 1; oneof Part { int32 x = 2; } }
service Client {
  rpc Get(GetIn) returns (stream GetResponse);
}
""")
    assert len(bad) == 9, bad
    print("\n".join(found) or "ok")
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main())
