# Workarounds for building against the ros-* wheels from PyPI instead of a sourced ROS.

# Make find_package and the ament index use the ROS packages that pip has installed: the wheels
# install a complete ROS prefix into the environment, with ament_package in its site-packages.
function(ros_wheels_use_prefix)
  execute_process(
    COMMAND "${Python3_EXECUTABLE}" -c
      "import ament_package, pathlib; print(pathlib.Path(ament_package.__file__).parents[4])"
    OUTPUT_VARIABLE prefix
    OUTPUT_STRIP_TRAILING_WHITESPACE
    RESULT_VARIABLE failed
  )
  if(failed)
    message(FATAL_ERROR "The ROS build wheels are missing: build with pip's build isolation.")
  endif()
  message(STATUS "ROS prefix: ${prefix}")
  set(CMAKE_PREFIX_PATH "${prefix}" ${CMAKE_PREFIX_PATH} PARENT_SCOPE)
  # Read by ament_cmake at configure time; excludes packages of a sourced ROS of another version.
  set(ENV{AMENT_PREFIX_PATH} "${prefix}")
endfunction()

# The Python generator targets in the wheels refer to include directories of the container in which
# they were built, and CMake rejects directories that do not exist. Remove them from the imported
# targets, and do not export ours in the same way.
function(ros_wheels_repair_include_directories package)
  get_property(imported_targets DIRECTORY PROPERTY IMPORTED_TARGETS)
  list(FILTER imported_targets INCLUDE REGEX "__rosidl_generator_py$")
  foreach(target IN LISTS imported_targets)
    set(existing "")
    get_target_property(folders ${target} INTERFACE_INCLUDE_DIRECTORIES)
    foreach(folder IN LISTS folders)
      if(folder MATCHES "^\\$<" OR EXISTS "${folder}")
        list(APPEND existing "${folder}")
      endif()
    endforeach()
    set_target_properties(${target} PROPERTIES INTERFACE_INCLUDE_DIRECTORIES "${existing}")
  endforeach()

  set(own_target "${package}__rosidl_generator_py")
  get_target_property(folders ${own_target} INTERFACE_INCLUDE_DIRECTORIES)
  if(folders)
    list(TRANSFORM folders REPLACE "^(.+)$" "$<BUILD_INTERFACE:\\1>")
    set_target_properties(${own_target} PROPERTIES INTERFACE_INCLUDE_DIRECTORIES "${folders}")
  endif()
endfunction()
