# Builds msg/*.msg and srv/*.srv into geomsrv.msg and geomsrv.srv (and their C and C++ types).
find_package(ament_cmake REQUIRED)
find_package(ament_cmake_python REQUIRED)
find_package(rosidl_default_generators REQUIRED)
set(message_packages
  builtin_interfaces
  diagnostic_msgs
  geometry_msgs
  sensor_msgs
  service_msgs
  std_msgs
  std_srvs
  visualization_msgs)
foreach(package IN LISTS message_packages)
  find_package(${package} REQUIRED)
endforeach()

# Message packages installed from wheels name an include directory of the machine that built them,
# and CMake refuses a target whose include directory does not exist. Elsewhere this changes nothing.
get_directory_property(imported_targets IMPORTED_TARGETS)
foreach(target IN LISTS imported_targets)
  get_target_property(directories ${target} INTERFACE_INCLUDE_DIRECTORIES)
  if(directories)
    set(existing)
    foreach(directory IN LISTS directories)
      if(EXISTS "${directory}" OR directory MATCHES "^\\$<")
        list(APPEND existing "${directory}")
      endif()
    endforeach()
    set_target_properties(${target} PROPERTIES INTERFACE_INCLUDE_DIRECTORIES "${existing}")
  endif()
endforeach()

ament_get_python_install_dir(PYTHON_INSTALL_DIR)

file(GLOB interfaces CONFIGURE_DEPENDS RELATIVE "${CMAKE_CURRENT_SOURCE_DIR}" msg/*.msg srv/*.srv)
if(interfaces)
  rosidl_generate_interfaces(geomsrv ${interfaces} DEPENDENCIES ${message_packages})
  ament_export_dependencies(rosidl_default_runtime)
endif()
