# The one place where dependencies are found, each with the reason why it is here.
# Debian's package names are in scripts/setup.sh.

find_program(CCACHE_PROGRAM ccache)  # compile time is a cost paid every day
if(CCACHE_PROGRAM AND NOT CMAKE_CXX_COMPILER_LAUNCHER)
  # Lets it cache files that use a precompiled header.
  set(CMAKE_CXX_COMPILER_LAUNCHER ${CMAKE_COMMAND} -E env CCACHE_SLOPPINESS=pch_defines,time_macros ${CCACHE_PROGRAM})
endif()

find_package(Threads REQUIRED)
find_package(PkgConfig REQUIRED)
find_package(Eigen3 3.4 REQUIRED NO_MODULE)    # SE(3) maths
find_package(OpenCV 4.6 REQUIRED COMPONENTS core imgproc features2d calib3d)  # arrays, DCT, SIFT
find_package(yaml-cpp REQUIRED)                # configuration
pkg_check_modules(FMT REQUIRED IMPORTED_TARGET fmt>=9)  # text for people; its CMake target adds a definition for Windows only
find_package(nlohmann_json REQUIRED)           # report.json, NDJSON
find_package(Ceres REQUIRED)                   # pose graph, circle fits (only libs/backend and libs/calibration)
pkg_check_modules(LIBZIP REQUIRED IMPORTED_TARGET libzip)  # nnmodel.pth; its CMake config is broken in Debian 12
pkg_check_modules(TURBOJPEG REQUIRED IMPORTED_TARGET libturbojpeg)  # pictures (only libs/image): OpenCV's imgcodecs and videoio
pkg_check_modules(PNG REQUIRED IMPORTED_TARGET libpng)           # load 90 libraries more, for 0.2 s of every start
find_package(SQLite3 REQUIRED)                  # sessions (only libs/slam)
find_package(SQLiteCpp REQUIRED)
find_package(ZLIB REQUIRED)                     # packed surfaces, checksums (libs/image, surface, slam)

if(GELSLAM_BUILD_PROGRAM OR GELSLAM_BUILD_LAB)
  find_package(CLI11 REQUIRED)                 # command line
  pkg_check_modules(HTTPLIB REQUIRED IMPORTED_TARGET cpp-httplib)  # the service of a scan (only libs/exchange)
  # Watertight meshes (only libs/exchange); methods that the laboratory compares with. Ubuntu 24.04 has no package of it.
  find_package(Open3D QUIET)
  if(NOT Open3D_FOUND)
    message(STATUS "Open3D is missing: gelslam export makes no watertight meshes, and gelslam-lab is not built")
    set(GELSLAM_BUILD_LAB OFF)
  endif()
endif()
if(GELSLAM_WITH_ASSIMP)
  pkg_check_modules(ASSIMP REQUIRED IMPORTED_TARGET assimp>=5)  # OBJ, STL and GLB files (only libs/mesh)
endif()
pkg_check_modules(LIBAV REQUIRED IMPORTED_TARGET libavformat libavcodec libavutil libswscale)  # videos and logs (libs/sensor, simulation)
if(GELSLAM_BUILD_VIEWER)
  find_package(glfw3 3.3 REQUIRED)             # the window (only libs/viewer), with:
  pkg_check_modules(EPOXY REQUIRED IMPORTED_TARGET epoxy)  # OpenGL functions
  pkg_check_modules(IMGUI REQUIRED IMPORTED_TARGET imgui)  # panels; backends included
endif()
if(GELSLAM_BUILD_SIMULATION)
  find_package(embree REQUIRED)                # ray casting and point-to-triangle distances, version 3 or 4
  add_library(gelslam_embree INTERFACE)
  target_include_directories(gelslam_embree INTERFACE ${CMAKE_CURRENT_LIST_DIR}/embree)
  target_compile_definitions(gelslam_embree INTERFACE GELSLAM_EMBREE=${embree_VERSION_MAJOR})
  target_link_libraries(gelslam_embree INTERFACE embree)
  find_package(meshoptimizer REQUIRED)         # meshes with fewer triangles (only libs/evaluation)
endif()
if(GELSLAM_BUILD_TESTS OR GELSLAM_BUILD_PYTHON)
  # The system's Python: pyenv and conda have neither Debian's NumPy nor its pybind11.
  if(NOT DEFINED Python_EXECUTABLE AND EXISTS /usr/bin/python3)
    set(Python_EXECUTABLE /usr/bin/python3)
  endif()
  find_package(Python 3.9 REQUIRED COMPONENTS Interpreter OPTIONAL_COMPONENTS Development.Module)
endif()
if(GELSLAM_BUILD_PYTHON)
  set(PYBIND11_FINDPYTHON ON)
  find_package(pybind11 2.10 REQUIRED)         # the Python module (only python/)
endif()
if(GELSLAM_BUILD_TESTS)
  find_package(GTest REQUIRED)
endif()
if(GELSLAM_BUILD_LAB)
  find_package(benchmark REQUIRED)              # micro-benchmarks
  find_package(OpenMP REQUIRED COMPONENTS CXX)  # keeps Open3D to one thread
endif()
