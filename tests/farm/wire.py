"""The wire as a stranger sees it: Python's stubs, generated from the proto files alone."""
import importlib
import shutil
import subprocess
import sys

try:
    import grpc  # noqa: F401
    import google.protobuf  # noqa: F401
except ImportError as error:
    print(f"skipped: {error}; install python3-grpcio and python3-protobuf")
    sys.exit(77)

from paths import ROOT  # noqa: E402

PB = {}  # the wire's modules by name, once load_proto has made them


def load_proto(folder):
    """Stubs of the wire, generated into a folder of the test's own."""
    plugin = shutil.which("grpc_python_plugin")
    if not plugin:
        print("skipped: there is no grpc_python_plugin; install protobuf-compiler-grpc")
        sys.exit(77)
    files = [str(p) for p in sorted((ROOT / "proto").rglob("*.proto"))]
    subprocess.run(["protoc", "--experimental_allow_proto3_optional", f"-I{ROOT / 'proto'}", f"--python_out={folder}",
                    f"--grpc_python_out={folder}", f"--plugin=protoc-gen-grpc_python={plugin}", *files], check=True)
    sys.path.insert(0, str(folder))
    names = ["types_pb2", "client_pb2", "client_pb2_grpc", "sequence_pb2", "worker_pb2", "worker_pb2_grpc"]
    PB.update({name: importlib.import_module(f"lightmill.v1.{name}") for name in names})
